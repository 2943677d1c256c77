# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole folder of measured files: parameter files and assets in another folder, and a summary.

It is what `fitter/jobs/batch.py` does, with the queue instead of processes of its own, and with an
asset for every fit. What was finished is found again by the next import of the folder.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...fitter.errors import NfmError, printable
from ...fitter.formats import parameter_file
from ...fitter.jobs import batch
from ...fitter.jobs.batch import FAILED, FITTED, KEPT, Outcome
from ...fitter.shading.icon import material_icon
from .. import asset_files, material_library, undo
from ..assets import Metadata
from .queue import FitResult, queue


@dataclass(eq=False)
class FolderImport:
    """One import of a folder.

    name : of the folder; of the catalogue, the asset library and the summary as well
    output : where everything goes; it exists
    jobs : of batch.jobs_of
    show : whether the output becomes an asset library of the user's
    outcomes : of the jobs so far
    """

    name: str
    output: Path
    jobs: list[batch.Job]
    show: bool
    outcomes: list[Outcome] = field(default_factory=list)
    is_cancelled: bool = False

    @property
    def catalogue(self) -> str:
        """Its name without what means something in a file of catalogues."""
        return printable(self.name).replace("/", "-").replace(":", "-").replace("\\", "-")

    def take(self, outcome: Outcome, icon: np.ndarray | None = None) -> str:
        """Note what became of a job and make its asset; after the last one, a message.

        icon : of the material, if it was made
        """
        if outcome.status != FAILED:
            try:
                self._write_asset(outcome, icon)
            except NfmError as error:
                outcome = Outcome(outcome.job, FAILED, str(error), outcome.fit)
        self.outcomes.append(outcome)
        return self.finish() if len(self.outcomes) == len(self.jobs) else ""

    def finish(self) -> str:
        """Write the summary of what was done, as a file and as a Text; returns its last line."""
        summary = batch.summary_text(self.outcomes)
        title = rpt_("Folder {:s}").format(self.catalogue)
        text = bpy.data.texts.get(title) or bpy.data.texts.new(title)
        text.from_string(summary)
        counts = summary.splitlines()[-1]
        try:
            batch.write_summary(self.output, self.outcomes)
        except NfmError as error:
            return str(error)
        undo.push(rpt_("Import Folder"))  # or undoing the next step would take the text away
        if self.show:
            material_library.register_folder(self.output, self.catalogue)
        return rpt_("{:s}: {:s}; the table is in the text {!r}").format(self.name, counts, title)

    def _write_asset(self, outcome: Outcome, icon: np.ndarray | None) -> None:
        job = outcome.job
        stem = job.output.name.removesuffix(parameter_file.SUFFIX)
        path = job.output.with_name(f"{stem}.blend")
        if outcome.status == KEPT and path.exists():
            return
        asset_files.write_catalogues(self.output, [self.catalogue])
        fitted = parameter_file.load(job.output)
        metadata = Metadata(
            description=rpt_("Measured BRDF: {:s}").format(printable(job.path.name)),
            catalogue=self.catalogue,
            tags=("measured", fitted.source.format if fitted.source else ""),
        )
        if icon is None:
            icon = material_icon(fitted.model)
        asset_files.write_material(path, fitted, icon, metadata)


@dataclass
class FolderItem:
    """Where the fit of one file of a folder goes; see queue.Landing."""

    folder: FolderImport
    job: batch.Job
    wants_draft: bool = False
    wants_shading: bool = True  # the default sampling has base lobes

    @property
    def output(self) -> str:
        """Its parameter file."""
        return str(self.job.output)

    def final(self, result: FitResult) -> str:
        """Write parameter file and asset."""
        fit = result.fitted.fit
        if result.kept:
            return self.folder.take(Outcome(self.job, KEPT, fit=fit), result.icon)
        try:
            parameter_file.save(self.job.output, result.fitted)
        except NfmError as error:
            return self.folder.take(Outcome(self.job, FAILED, str(error), fit))
        return self.folder.take(Outcome(self.job, FITTED, fit=fit), result.icon)

    def fail(self, message: str) -> str:
        """List it and go on; an ERROR would open a window for every file."""
        if text := self.folder.take(Outcome(self.job, FAILED, message)):
            queue.messages.append(("INFO", text))
        return "WARNING"

    def abandon(self) -> None:
        """Cancel the rest of the folder too; what is finished stays, and the summary says so."""
        if self.folder.is_cancelled:
            return
        self.folder.is_cancelled = True
        others = [job for job in queue.jobs if getattr(job.landing, "folder", None) is self.folder]
        for job in others:
            queue.jobs.remove(job)  # they wait: only the first one has a process
        queue.messages.append(("INFO", self.folder.finish()))
