# SPDX-License-Identifier: GPL-3.0-or-later
"""What an import costs: the process with the fitter until its draft, and what Blender does itself.

CPU seconds, and wall seconds until the draft is in the scene, which are those of an artist only on
a machine that does nothing else. The process is the add-on's own, from its start. Fitted files need
no process until they are shown: how long the interface is held by them, and by a script that waits.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from importlib import import_module
from pathlib import Path
from types import ModuleType

from fitter.errors import NfmError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs.job import DRAFT, FINAL
from runner.blender import load_extension
from runner.environment import CHECKOUT

from . import shared_data

MATERIALS = ("nylon", "aluminium", "pink-fabric", "brushed-metal", "woven-cloth")
FITTED = ("cg_sunflower", "brushed-steel")  # of the material library; the second is anisotropic
PAUSE = 0.02  # seconds between looks at the process; the add-on looks every 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench import."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(MATERIALS))
    parser.add_argument("--draft-only", action="store_true", help="do not wait for the fit")


def run(arguments: argparse.Namespace) -> int:
    """Print a line for each material."""
    shared_data.require_shared()
    addon = f"{load_extension().__name__}.nfm_addon"
    material = import_module(f"{addon}.material")
    process, queue = (import_module(f"{addon}.fitting.{name}") for name in ("process", "queue"))
    print(f"{os.getloadavg()[0]:.1f} other processes ran or wanted to in the last minute")
    print(
        f"{'':<24}{'until the draft':>17}{'building':>10}{'wall':>8}{'in all':>9}{'replacing':>11}"
    )
    for name in arguments.materials.split(","):
        with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
            if name in shared_data.anisotropic_names():
                path = Path(folder, f"{name}.bin")
                shared_data.write_anisotropic(name, path)
            else:
                path = Path(folder, f"{name}.binary")
                shared_data.write_material(name, path)
            start = time.monotonic()
            seconds, draft = _fit(process, queue, path, DRAFT)
            before = time.process_time()
            item = material.build(draft)
            building, wall = time.process_time() - before, time.monotonic() - start
            line = f"{name:<24}{seconds:>17.2f}{building:>10.2f}{wall:>8.2f}"
            if not arguments.draft_only:
                seconds, final = _fit(process, queue, path, FINAL)
                before = time.process_time()
                material.replace_model(item, final)
                line += f"{seconds:>9.1f}{time.process_time() - before:>11.2f}"
            print(line, flush=True)
    print(f"\n{'fitted file':<24}{'first held':>17}{'again':>10}{'waiting':>9}")
    for name in FITTED:
        held = [_landed(addon, name, waits) for waits in (False, False, True)]
        print(f"{name:<24}{held[0]:>17.2f}{held[1]:>10.2f}{held[2]:>9.2f}", flush=True)
    return 0


def _landed(addon: str, name: str, waits: bool) -> float:
    """CPU seconds that a fitted file takes of Blender's own thread."""
    landing, queue, known = (
        import_module(f"{addon}.{module}")
        for module in ("fitting.landing", "fitting.queue", "known_shadings")
    )
    known.forget()
    start = time.process_time()
    fitted = parameter_file.load(CHECKOUT / "library" / f"{name}{parameter_file.SUFFIX}")
    landing.NewMaterial(name, "NATIVE", [], waits=waits).final(queue.FitResult(fitted))
    return time.process_time() - start


def _fit(
    process: ModuleType, queue: ModuleType, path: Path, until: str
) -> tuple[float, FittedMaterial]:
    """CPU seconds of a process until an event, and the material that came with it."""
    before = _seconds_of_children()
    fit = process.FitProcess(str(path), "standard", draft=True, shading=True)
    found = None
    try:
        while found is None:
            time.sleep(PAUSE)
            for event in fit.events():
                if event.kind == "error":
                    raise NfmError(event.text)
                if event.kind == until:
                    found = queue.result_of(event).fitted
    finally:
        fit.close()
    return _seconds_of_children() - before, found


def _seconds_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
