# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits that wait and the one that runs, in the order in which they were asked for.

`queue` is the only one. A timer of Blender's calls its `pump`, which never waits; where no timers
run (in the background) a caller may pump itself.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_rpt as rpt_

from ...fitter.errors import NfmError, shown_name
from ...fitter.formats import parameter_file
from ...fitter.formats.parameter_file import FittedMaterial
from ...fitter.jobs.job import (
    DRAFT,
    FINAL,
    ICON_FILE,
    KEPT,
    SLICES_FILE,
    Event,
    shading_path,
)
from ...fitter.shading import shading
from .. import known_shadings
from .process import FitProcess

INTERVAL = 0.1  # seconds between two pumps

# While one of these is dragged with the mouse, results wait: an undo step would cut it in two.
DRAGGING = "TRANSFORM_OT_"


@dataclass(frozen=True)
class FitResult:
    """A finished fit.

    slices : fitter.grading.slices.measured_slices of the data, if it was at hand
    icon : fitter.shading.icon.material_icon, if it was made
    kept : whether it had been there before
    """

    fitted: FittedMaterial
    slices: np.ndarray | None = None
    icon: np.ndarray | None = None
    kept: bool = False


class Landing(Protocol):
    """Where the result of a fit goes."""

    wants_draft: bool
    wants_shading: bool  # base lobes from the fit's process: the interface need not wait for them
    output: str | None  # as in job.Request

    def draft(self, result: FitResult) -> None:
        """Show a first result, if wants_draft. May raise NfmError."""

    def final(self, result: FitResult) -> str:
        """Show the result, in place of the draft; returns a message. May raise NfmError."""

    def fail(self, message: str) -> str:
        """Undo what the draft did; returns the level of what is reported, as Operator.report."""

    def abandon(self) -> None:
        """Undo what the draft did: the fit was cancelled."""


@dataclass(eq=False)
class Job:
    """One fit.

    encoding : as readers.read takes it
    step, progress : what it does and how far it is, 0..1
    started : time.monotonic() when it began to run
    """

    path: str
    quality: str
    landing: Landing
    encoding: str | None = None
    step: str = "Waiting"
    progress: float = 0.0
    started: float | None = None
    process: FitProcess | None = None

    @property
    def name(self) -> str:
        """Name of the file, as messages show it."""
        return shown_name(self.path)

    def seconds_left(self) -> float | None:
        """Estimate from the speed so far; None while there is nothing to tell it from."""
        if self.started is None or self.progress < 0.05:
            return None
        return (time.monotonic() - self.started) * (1 / self.progress - 1)


@dataclass
class FitQueue:
    """See the module.

    jobs : the first one runs
    messages : (level, text) for whoever can report them
    """

    jobs: list[Job] = field(default_factory=list)
    messages: deque[tuple[str, str]] = field(default_factory=deque)

    def add(self, job: Job) -> None:
        """Append a job; the timer starts with the first one."""
        self.jobs.append(job)
        if not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=0)

    def pump(self) -> bool:
        """Take up what the running fit has told; returns whether there is still one."""
        if not self.jobs or _is_dragging():
            return bool(self.jobs)
        job = self.jobs[0]
        if job.process is None:
            self._start(job)
        else:
            for event in job.process.events():
                self._take(job, event)
        return bool(self.jobs)

    def cancel(self, job: Job) -> None:
        """End a job and leave nothing of it."""
        self._end(job)
        job.landing.abandon()
        self.messages.append(("INFO", rpt_("{:s}: cancelled").format(job.name)))

    def forget_all(self) -> None:
        """End all jobs when their file is closed: what they made goes with it."""
        for job in list(self.jobs):
            self._end(job)
        self.messages.clear()

    def _start(self, job: Job) -> None:
        try:
            job.process = FitProcess(
                job.path,
                job.quality,
                draft=job.landing.wants_draft,
                encoding=job.encoding,
                output=job.landing.output,
                shading=job.landing.wants_shading,
            )
        except OSError as error:
            self._fail(job, rpt_("Python could not be started ({:s})").format(str(error)))
            return
        job.started = time.monotonic()

    def _take(self, job: Job, event: Event) -> None:
        job.step, job.progress = event.text, event.progress
        try:
            if event.kind == DRAFT:
                job.step = "Draft"
                job.landing.draft(result_of(event))
            elif event.kind in (FINAL, KEPT):
                result = result_of(event)
                self._end(job)
                self.messages.append(("INFO", job.landing.final(result)))
            elif event.kind == "error":
                self._fail(job, event.text)
        except NfmError as error:
            self._fail(job, str(error))

    def _fail(self, job: Job, message: str) -> None:
        self._end(job)
        self.messages.append((job.landing.fail(message), message))

    def _end(self, job: Job) -> None:
        if job in self.jobs:
            self.jobs.remove(job)
        if job.process:
            job.process.close()
            job.process = None


def result_of(event: Event) -> FitResult:
    """What came with an event; its base lobes are known from then on."""
    path = Path(event.text)
    fitted = parameter_file.load(path)
    if (found := shading_path(path)).exists():
        known_shadings.remember(fitted.model, shading.load(found))
    slices, icon = path.with_name(SLICES_FILE), path.with_name(ICON_FILE)
    return FitResult(
        fitted,
        slices=np.load(slices) if slices.exists() else None,
        icon=np.load(icon) if icon.exists() else None,
        kept=event.kind == KEPT,
    )


def _is_dragging() -> bool:
    windows = bpy.context.window_manager.windows
    return any(
        operator.bl_idname.startswith(DRAGGING)
        for window in windows
        for operator in window.modal_operators
    )


def _tick() -> float | None:
    return INTERVAL if queue.pump() else None


@persistent
def _file_closes(*_arguments: object) -> None:
    queue.forget_all()


queue = FitQueue()


def register() -> None:
    bpy.app.handlers.load_pre.append(_file_closes)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_file_closes)
    queue.forget_all()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
