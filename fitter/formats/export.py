# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted material as a file of measurements, for renderers that read those."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ..errors import MeasurementError, shown_name
from ..geometry import merl_bins
from ..grading import anisotropic_metrics, metrics
from ..models.anisotropic_model import AnisotropicModel
from ..models.model import FactorModel
from . import merl, utia

AnyModel = FactorModel | AnisotropicModel


def write(path: str | os.PathLike, model: AnyModel) -> None:
    """Write a file of the format that the suffix asks for, all or nothing.

    Raises
    ------
    MeasurementError
        The suffix is that of no format, or of one that cannot hold this model, or the file cannot
        be written.
    """
    suffix = Path(os.fsdecode(path)).suffix.lower()
    if suffix not in WRITERS:
        raise MeasurementError(
            f"{shown_name(path)}: not a name of a file that can be exported; let it end in "
            f"{' or '.join(WRITERS)}"
        )
    WRITERS[suffix](path, model)


def suffix_for(kind: str) -> str:
    """The suffix of files that hold a model of this kind best."""
    return ".bin" if kind == AnisotropicModel.kind else ".binary"


def _write_merl(path: str | os.PathLike, model: AnyModel) -> None:
    """The values at the bin centres; bins below the horizon are -1, as in the database."""
    if isinstance(model, AnisotropicModel):
        raise MeasurementError(
            f"{shown_name(path)}: an anisotropic material, and a MERL file holds isotropic ones "
            "only; let it end in .bin"
        )
    merl.write(path, metrics.tabulate(model), merl_bins().above_horizon)


def _write_utia(path: str | os.PathLike, model: AnyModel) -> None:
    """The values at the angles of the UTIA database, up to 75 degrees, as linear numbers."""
    utia.write_bin(path, anisotropic_metrics.tabulate(model))


WRITERS: dict[str, Callable[[str | os.PathLike, AnyModel], None]] = {
    ".binary": _write_merl,
    ".bin": _write_utia,
}
