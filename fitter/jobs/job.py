# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit in a process of its own: what happens is told on standard output, a line of JSON each.

The interface that starts it stays responsive whatever the fit does, and ends it by ending the
process. `main` takes one argument, a `Request` as JSON; the lines are `Event`s. A draft comes first
if it is asked for, then the fit proper, both as parameter files in the request's folder.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..errors import NfmError
from ..fitting.fit import FitStep
from ..formats import parameter_file, readers
from ..formats.parameter_file import FittedMaterial
from ..grading.slices import measured_slices
from ..measurement import Measurement
from ..shading import shading
from ..shading.icon import material_icon
from . import batch
from .fit_file import fit_measurement, is_parameter_file

DRAFT, FINAL, KEPT = "draft", "final", "kept"
SLICES_FILE, ICON_FILE = "slices.npy", "icon.npy"

# CPU seconds that the parts of a job take, for its progress (docs/RESULTS.md).
SECONDS = {"read": 0.5, "draft": 2.0, "standard": 8.5, "best": 16.0, "grade": 1.0}

# The stages of fit.FitStep in words that say what is going on.
STAGES = {
    "sweep": "Trying start",
    "explore": "Improving start",
    "final": "Going on with start",
    "refine": "Refining",
    "polish": "Polishing",
    "limit": "Limiting energy",
    "appearance": "Matching pictures",
}

Emit = Callable[["Event"], None]


@dataclass(frozen=True)
class Request:
    """What to do.

    path : of a measured file, or of a parameter file, which needs no fit
    quality : a name in quality.QUALITIES
    draft : whether a draft comes first
    folder : an existing one, for the results
    encoding : as readers.read takes it
    output : parameter file of a batch: where it holds this fit already, that is the answer, and an
        encoding is only for formats that have one
    shading : whether base lobes are wanted too
    """

    path: str
    quality: str
    draft: bool
    folder: str
    encoding: str | None = None
    output: str | None = None
    shading: bool = False

    @property
    def has_draft(self) -> bool:
        """Whether a draft comes before a better fit."""
        return self.draft and self.quality != "draft"


@dataclass(frozen=True)
class Event:
    """One line of the answer.

    kind : "step", "draft", "final" or "kept" (its parameter file is written), or "error"
    text : name of the step, path of the file, or the message
    progress : 0..1 of the whole job
    """

    kind: str
    text: str
    progress: float


def run(request: Request, emit: Emit) -> None:
    """Read and fit, once or twice; an error of the file becomes the last event."""
    folder = Path(request.folder)
    parts = _parts(request)
    try:
        emit(Event("step", "Reading", 0.0))
        encoding = request.encoding
        if request.output:
            job = batch.Job(Path(request.path), Path(request.output))
            settings = batch.Settings(quality=request.quality, encoding=encoding)
            if kept := batch.kept_fit(job, settings):
                _finish(request, KEPT, kept, emit)
                return
            encoding = batch.encoding_of(job.path, settings)
        if is_parameter_file(request.path):
            _finish(request, FINAL, parameter_file.load(request.path), emit)
            return
        measurement = readers.read(request.path, encoding=encoding)
        if request.has_draft:
            draft = fit_measurement(
                measurement,
                quality="draft",
                on_step=_teller(emit, "Draft", *parts["draft"]),
                graded=False,
            )
            _save(request, DRAFT, draft, emit, (parts["draft"][1], parts["draft"][1]))
        final = fit_measurement(
            measurement,
            quality=request.quality,
            on_step=_teller(emit, "", *parts[request.quality]),
        )
        emit(Event("step", "Grading", parts[request.quality][1]))
        if isinstance(measurement, Measurement):  # one plane of incidence says it all
            np.save(folder / SLICES_FILE, measured_slices(measurement).astype(np.float32))
        _finish(request, FINAL, final, emit)
    except NfmError as error:
        emit(Event("error", str(error), 1.0))


def _parts(request: Request) -> dict[str, tuple[float, float]]:
    """Where each part of the job begins and ends on its progress, 0..1."""
    names = ["read", *(["draft"] if request.has_draft else []), request.quality, "grade"]
    ends = np.cumsum([SECONDS[name] for name in names])
    starts = np.concatenate([[0.0], ends[:-1]])
    return {
        name: (round(float(start / ends[-1]), 6), round(float(end / ends[-1]), 6))
        for name, start, end in zip(names, starts, ends, strict=True)
    }


def _teller(emit: Emit, title: str, start: float, end: float) -> Callable[[FitStep], None]:
    """Tell every step of a fit, on its part of the progress."""

    def tell(step: FitStep) -> None:
        stage, _, number = step.stage.partition(" ")
        text = title or " ".join(filter(None, (STAGES.get(stage, stage), number)))
        # as the parts, so that it never falls
        emit(Event("step", text, round(start + (end - start) * step.progress, 6)))

    return tell


def shading_path(parameters: Path) -> Path:
    """Where the base lobes are that belong to a parameter file of a job."""
    return parameters.with_name(parameters.name.removesuffix(parameter_file.SUFFIX) + ".npz")


def _finish(request: Request, kind: str, material: FittedMaterial, emit: Emit) -> None:
    np.save(Path(request.folder) / ICON_FILE, material_icon(material.model))
    _save(request, kind, material, emit, _parts(request)["grade"])


def _save(
    request: Request,
    kind: str,
    material: FittedMaterial,
    emit: Emit,
    progress: tuple[float, float],
) -> None:
    """Write a result and tell of it; progress is that before and after."""
    path = Path(request.folder) / f"{kind}{parameter_file.SUFFIX}"
    parameter_file.save(path, material)
    if request.shading:
        emit(Event("step", "Base lobes", progress[0]))
        shading.save(shading_path(path), shading.shade(material.model, draft=kind == DRAFT))
    emit(Event(kind, str(path), progress[1]))


def main(argument: str) -> None:
    """Run a request given as JSON; ends when nobody reads the answer any more."""

    def emit(event: Event) -> None:
        sys.stdout.write(json.dumps(asdict(event)) + "\n")
        sys.stdout.flush()

    try:
        run(Request(**json.loads(argument)), emit)
    except BrokenPipeError:
        # whoever asked is gone; Python would complain again while it flushes at exit
        sys.stdout = None
