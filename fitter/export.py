# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted material as a file of measurements, for renderers that read those."""

from __future__ import annotations

import os

from . import merl
from .geometry import merl_bins
from .metrics import tabulate
from .model import FactorModel


def write_merl(path: str | os.PathLike, model: FactorModel) -> None:
    """Write the values of a model at the bin centres as a MERL .binary file, all or nothing.

    Bins below the horizon are stored as the database does, as -1.

    Raises
    ------
    MeasurementError
        The file cannot be written.
    """
    merl.write(path, tabulate(model), merl_bins().above_horizon)
