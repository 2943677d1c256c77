# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb compare."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks import shared_data
from fitter import command_line as fitter_command_line
from fitter.errors import NfmError, shown_name
from fitter.files import write_atomically
from fitter.fitting.quality import DEFAULT_QUALITY, QUALITIES
from fitter.fitting.weights import DEFAULT_WEIGHT, WEIGHTS
from fitter.formats import readers
from fitter.jobs import batch
from fitter.jobs.fit_file import material_name
from fitter.jobs.progress import Progress

from . import pool, report
from .mesh import read_ply
from .models import KEYS, Settings
from .scenes import SceneSource, reduced
from .store import Store, result_key

# Materials whose factors Peng et al. 2017 show in fig. 5.
FIGURE_5 = ("aluminium", "violet-acrylic", "polyurethane-foam")


def main(argv: Sequence[str]) -> int:
    """Parse and run; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="nfm compare",
        description="Fit our model and three others to each file, and write a report with a table "
        "and pictures. What is finished is kept in DIR and not fitted again.",
    )
    parser.add_argument("files", metavar="FILE", nargs="+", type=Path, help=readers.EXPECTED)
    parser.add_argument("--report", metavar="DIR", type=Path, required=True)
    parser.add_argument(
        "--env",
        metavar="MAP",
        type=Path,
        help="light of both scenes, .hdr or .exr; default: the shared Grace and Grove",
    )
    parser.add_argument(
        "--curves",
        metavar="NAME",
        nargs="+",
        help=f"materials whose factors are drawn; default: {', '.join(FIGURE_5)}",
    )
    parser.add_argument("--weight", choices=sorted(WEIGHTS), default=DEFAULT_WEIGHT)
    parser.add_argument(
        "--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY, help="effort of the fits"
    )
    parser.add_argument(
        "--golden-section",
        action="store_true",
        help="fit Independent-G as Bagher et al. 2016 did, by alternation only",
    )
    parser.add_argument(
        "--jobs",
        metavar="N",
        type=fitter_command_line.positive,
        default=2,
        help="processes, of one thread each",
    )
    parser.add_argument(
        "--markdown", metavar="FILE", type=Path, help="write the tables here as well, for docs/"
    )
    parser.add_argument(
        "--note", metavar="TEXT", help="about the data; it stands at the report's beginning"
    )
    parser.set_defaults(run=run)
    return fitter_command_line.run(parser, argv)


def run(arguments: argparse.Namespace) -> None:
    """The verb."""
    settings = Settings(arguments.weight, arguments.quality, arguments.golden_section)
    folder = batch.made_folder(arguments.report)
    if arguments.markdown and not arguments.markdown.parent.is_dir():
        raise NfmError(f"{shown_name(arguments.markdown)}: there is no such folder; make it first")
    scenes, notes = scene_sources(arguments.env)
    if arguments.note:
        notes.insert(0, arguments.note)
    keys: dict[str, str] = {}
    tasks = []
    store = Store(folder / "results")
    with Progress(sys.stderr, "compare") as progress:
        names = []
        for number, path in enumerate(arguments.files):
            # a file that cannot be read is found before the others are fitted
            progress.update(number / len(arguments.files), "reading")
            sha256 = readers.read_isotropic(path).source.sha256
            if sha256 in keys:
                continue
            names.append(material_name(path.name))
            keys[sha256] = result_key(sha256, settings, scenes)
            if store.load(keys[sha256]) is None:
                tasks.append(pool.Task(path, sha256, keys[sha256]))
        for name in arguments.curves or ():
            if name not in names:
                raise NfmError(f"--curves {name}: no such material, there are {', '.join(names)}")
        _grade(tasks, len(keys), settings, scenes, store, arguments.jobs, progress)
        progress.update(1, "writing the report")
        results = [store.load(key) for key in keys.values()]
        curves = arguments.curves or [name for name in FIGURE_5 if name in names]
        content = report.Content(
            results=results,
            scenes=[scene.name for scene in scenes],
            notes=notes,
            settings=settings,
            curves=curves,
        )
        report.write(content, folder)
    if arguments.markdown:
        text = report.tables_as_markdown(content)
        write_atomically(arguments.markdown, [text.encode()])
    sys.stdout.write(f"{report.summary_text(content)}written to {folder / 'report.html'}\n")


def _grade(
    tasks: list[pool.Task],
    total: int,
    settings: Settings,
    scenes: list[SceneSource],
    store: Store,
    jobs: int,
    progress: Progress,
) -> None:
    done = total - len(tasks)
    progress.update(done / total, f"{done} of {total} materials")
    if not tasks:
        return
    for n_steps, task in pool.run(tasks, settings, scenes, store, jobs):
        done += task is not None
        share = (total - len(tasks) + n_steps / len(KEYS)) / total
        progress.update(share, f"{done} of {total} materials")


def scene_sources(environment: Path | None) -> tuple[list[SceneSource], list[str]]:
    """The paper's two scenes, as far as their parts are there, and what to say of the others.

    environment : a map for both instead of Grace and Grove
    """
    sources, notes = [], []
    for subject, default, name in (
        ("sphere", shared_data.GRACE, "Grace"),
        ("Buddha", shared_data.GROVE, "Grove"),
    ):
        path = environment or default
        light = material_name(path.name) if environment else name
        needed = [path, shared_data.BUDDHA] if subject == "Buddha" else [path]
        missing = [p for p in needed if p != environment and not p.is_file()]
        if missing:
            notes.append(
                f"There is no {subject} in {light}: {' and '.join(p.name for p in missing)} "
                "of the shared data cannot be found. A map can be given with --env."
            )
            continue
        triangles = read_ply(shared_data.BUDDHA) if subject == "Buddha" else None
        sources.append(SceneSource(f"{subject} in {light}", _read_map(path), triangles))
    return sources, notes


def _read_map(path: Path) -> np.ndarray:
    try:
        return reduced(_images().read_linear(path))
    except ValueError as error:
        # Blender has its own copy of the package, so its NfmError is another class
        raise NfmError(str(error)) from None


@cache
def _images() -> ModuleType:
    """The add-on's reader of images; loads Blender, which only maps need."""
    from runner.blender import load_extension

    return import_module(f"{load_extension().__name__}.nfm_addon.images")
