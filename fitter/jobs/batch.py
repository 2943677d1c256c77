# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit a whole folder of measured files, each to a parameter file in another folder.

A file whose fit is there already is left alone: the parameter file names the measurement by its
sha256, and the settings. So an interrupted batch goes on where it stopped, wherever its processes
ran. A file that cannot be fitted is reported and does not stop the others. Every process holds one
measurement at a time.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ..errors import NfmError, printable, shown_name
from ..fitting.prior import DEFAULT_STRENGTH
from ..fitting.quality import DEFAULT_QUALITY
from ..fitting.weights import DEFAULT_WEIGHT
from ..formats import measured_file, parameter_file, readers
from ..formats.measured_file import opened
from ..formats.parameter_file import FittedMaterial
from . import workers
from .fit_file import fit_measurement, material_name

FITTED, KEPT, FAILED = "fitted", "kept", "failed"

# What a batch leaves beside its parameter files.
SUMMARY = "summary.json"

# Figures of the summary: heading, name among the figures of a fit, format.
COLUMNS = (
    ("objective", "objective", "{:.2e}"),
    ("log error", "mean_log_error", "{:.4f}"),
    ("albedo", "largest_directional_albedo", "{:.3f}"),
)


@dataclass(frozen=True)
class Settings:
    """How to read and fit: `encoding` as readers.read takes it, the others as fit.fit_steps does.

    The encoding is that of UTIA files; files of other formats, which have no choice, are read as
    they are.
    """

    weight: str = DEFAULT_WEIGHT
    quality: str = DEFAULT_QUALITY
    prior_strength: float = DEFAULT_STRENGTH
    encoding: str | None = None


@dataclass(frozen=True)
class Job:
    """A measured file and the parameter file it becomes."""

    path: Path
    output: Path


@dataclass(frozen=True)
class Outcome:
    """What became of a job.

    status : FITTED, KEPT (it was there already) or FAILED
    message : why it failed
    fit : figures of the fit
    seconds : CPU time of this job
    """

    job: Job
    status: str
    message: str = ""
    fit: dict[str, float | int | str] | None = None
    seconds: float = 0.0


def jobs_of(folder: Path, output: Path) -> list[Job]:
    """The files of a folder that have a suffix of a measured format, by name.

    Files of one stem, which would become one parameter file, keep their suffixes in its name.

    Raises
    ------
    NfmError
        There are none, or the folder cannot be read.
    """
    try:
        paths = sorted(p for p in folder.iterdir() if p.suffix.lower() in readers.SUFFIXES)
    except OSError as error:
        raise NfmError(
            f"{shown_name(folder)}: cannot be read ({error.strerror or error}); "
            "check its permissions"
        ) from error
    if not paths:
        raise NfmError(
            f"{shown_name(folder)}: holds no file with the suffix {' or '.join(readers.SUFFIXES)}; "
            "choose another folder"
        )
    stems = Counter(path.stem.lower() for path in paths)
    return [
        Job(path, output / f"{_stem(path, stems[path.stem.lower()] > 1)}{parameter_file.SUFFIX}")
        for path in paths
    ]


def made_folder(folder: Path) -> Path:
    """A folder, made if it is not there.

    Raises
    ------
    NfmError
        It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise NfmError(
            f"{shown_name(folder)}: cannot be made a folder ({error.strerror or error}); "
            "choose another"
        ) from None
    return folder


def run(jobs: Sequence[Job], settings: Settings, processes: int) -> Iterator[Outcome | None]:
    """Fit all; yield each Outcome as it comes, and None now and then while there is none."""
    work = partial(fit_one, settings=settings)
    if __package__ != "fitter":
        # inside Blender, whose processes could not import this package
        return map(work, jobs)
    return workers.run(work, jobs, processes)


def fit_one(job: Job, settings: Settings) -> Outcome:
    """Fit one file, if that was not done before, and write its parameter file."""
    start = time.process_time()
    try:
        kept = kept_fit(job, settings)
        if kept is not None:
            return Outcome(job, KEPT, fit=kept.fit)
        material = fit_measurement(
            readers.read(job.path, encoding=encoding_of(job.path, settings)),
            weight=settings.weight,
            quality=settings.quality,
            prior_strength=settings.prior_strength,
        )
        parameter_file.save(job.output, material)
    except NfmError as error:
        return Outcome(job, FAILED, message=str(error))
    return Outcome(job, FITTED, fit=material.fit, seconds=time.process_time() - start)


def summary_text(outcomes: Sequence[Outcome]) -> str:
    """A table for people, a line for each file by name, and how many of each status."""
    ordered = sorted(outcomes, key=lambda outcome: outcome.job.path)
    names = [printable(outcome.job.output.name) for outcome in ordered]
    width = max(map(len, names), default=0)
    lines = []
    for name, outcome in zip(names, ordered, strict=True):
        figures = [outcome.message]
        if outcome.fit is not None:
            figures = [
                f"{heading} {text.format(outcome.fit[key])}"
                for heading, key, text in COLUMNS
                if isinstance(outcome.fit.get(key), (int, float))
            ]
        lines.append(f"{name:{width}}  {outcome.status:6}  {'  '.join(figures)}".rstrip())
    counts = Counter(outcome.status for outcome in outcomes)
    lines.append(", ".join(f"{counts[status]} {status}" for status in (FITTED, KEPT, FAILED)))
    return "".join(f"{line}\n" for line in lines)


def summary_rows(outcomes: Sequence[Outcome]) -> list[dict[str, object]]:
    """The same for programs."""
    return [
        {
            "file": outcome.job.path.name,
            "output": outcome.job.output.name,
            "status": outcome.status,
            "message": outcome.message,
            "cpu_seconds": round(outcome.seconds, 3),
            **(outcome.fit or {}),
        }
        for outcome in sorted(outcomes, key=lambda outcome: outcome.job.path)
    ]


def _stem(path: Path, is_shared: bool) -> str:
    return path.name if is_shared else material_name(path.name)


def encoding_of(path: Path, settings: Settings) -> str | None:
    """The encoding that a file is read with; None for formats that have no choice.

    Raises
    ------
    MeasurementError
        The file cannot be read.
    """
    return readers.offered_encoding(path, settings.encoding)


def kept_fit(job: Job, settings: Settings) -> FittedMaterial | None:
    """What the parameter file holds if it is the fit of this measurement with these settings.

    Raises
    ------
    MeasurementError
        The measured file cannot be read.
    """
    with opened(job.path, readers.EXPECTED) as file:
        sha256 = hashlib.file_digest(file.stream, "sha256").hexdigest()
    return fit_of(job.output, sha256, settings, encoding_of(job.path, settings))


def fit_of(
    output: Path, sha256: str, settings: Settings, encoding: str | None = None
) -> FittedMaterial | None:
    """What a parameter file holds if it is the fit of a measurement with this sha256."""
    try:
        material = parameter_file.load(output)
    except NfmError:
        # not there, cut off or something else: as good as none
        return None
    wanted = {
        "weight": settings.weight,
        "quality": settings.quality,
        "prior_strength": settings.prior_strength,
        **({"encoding": encoding} if encoding else {}),
    }
    same = all(material.fit.get(key) == value for key, value in wanted.items())
    if same and material.source is not None and material.source.sha256 == sha256:
        return material
    return None


def write_summary(folder: Path, outcomes: Sequence[Outcome]) -> str:
    """Write SUMMARY beside the parameter files; returns its text, JSON.

    Raises
    ------
    NfmError
        It cannot be written.
    """
    rows = json.dumps(summary_rows(outcomes), indent=1)
    measured_file.write(folder / SUMMARY, [rows.encode()], "another folder")
    return rows
