# SPDX-License-Identifier: GPL-3.0-or-later
"""Base lobes that take seconds, found by the fitter's process while the interface goes on."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy
from bpy.app.handlers import persistent

from ..fitter.formats import parameter_file
from ..fitter.formats.parameter_file import FittedMaterial
from ..fitter.jobs.job import FINAL, shading_path
from ..fitter.models.factors import Factors
from ..fitter.shading import shading
from . import known_shadings
from .fitting.process import FitProcess


class _Search:
    """The base lobes of one model being found."""

    def __init__(self, model: Factors) -> None:
        self.model = model
        self._folder = tempfile.TemporaryDirectory(prefix="nfm-", dir=bpy.app.tempdir)
        path = Path(self._folder.name) / f"model{parameter_file.SUFFIX}"
        parameter_file.save(path, FittedMaterial("model", model))
        self._process = FitProcess(str(path), "standard", draft=False, shading=True)

    def has_ended(self) -> bool:
        """Take up what the process has told; whether that was all."""
        for event in self._process.events():
            if event.kind == FINAL:
                found = shading.load(shading_path(Path(event.text)))
                known_shadings.remember(self.model, found)
            if event.kind != "step":
                return True
        return False

    def close(self) -> None:
        self._process.close()
        self._folder.cleanup()


_search: _Search | None = None


def is_over(model: Factors) -> bool:
    """Whether there is nothing to wait for; else its base lobes are being looked for.

    A search for another model ends: there is one at a time, for what was edited last. Where it
    fails, whoever needs the base lobes has to find them alone.
    """
    global _search
    if known_shadings.find(model):
        return True
    if _search is None or not known_shadings.is_same(_search.model, model):
        stop()
        try:
            _search = _Search(model)
        except OSError:
            return True
    if not _search.has_ended():
        return False
    stop()
    return True


def stop() -> None:
    """End the search, if there is one."""
    global _search
    if _search:
        _search.close()
    _search = None


@persistent
def _file_closes(*_arguments: object) -> None:
    stop()


def register() -> None:
    bpy.app.handlers.load_pre.append(_file_closes)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_file_closes)
    stop()
