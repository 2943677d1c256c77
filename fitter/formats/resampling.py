# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements of other shapes, tabulated on the grids that are fitted: MERL's and UTIA's.

Every bin or node holds the value at its centre, which is what a fit compares with: the model is
evaluated there too. Files that hold both directions of a pair apart are not quite reciprocal, and a
pair then holds the mean of the two.

Negative channels, of colours out of gamut, become 0 and are counted; what is not finite in some
channel is masked.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .. import polar_grid
from ..anisotropic_measurement import AnisotropicMeasurement, ClampReport
from ..errors import MeasurementError, shown_name
from ..geometry import (
    N_PHI_D,
    N_THETA_D,
    N_THETA_H,
    directions_from_rusinkiewicz,
    merl_bins,
    phi_d_centres,
    theta_d_centres,
    theta_h_centres,
)
from ..measurement import BinReport, Measurement, Source

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


def to_merl_grid(f_r: Evaluate, source: Source, *, reciprocal: bool = True) -> Measurement:
    """Measurement of an isotropic BRDF that is known for all pairs of directions.

    Parameters
    ----------
    f_r
        Takes unit wi, wo (n, 3) to linear RGB (n, 3), 1/sr.
    source
        What it came from.
    reciprocal
        Take the mean of f_r(wi, wo) and f_r(wo, wi); otherwise f_r(wi, wo) alone.

    Raises
    ------
    MeasurementError
        There is nothing to fit.
    """
    above_horizon = merl_bins().above_horizon
    table = _tabulated(f_r)
    with np.errstate(invalid="ignore"):
        negative = (table < 0).any(-1)
        np.maximum(table, 0, out=table)
        if reciprocal:
            # the bins phi_d and pi - phi_d hold the same pair, swapped
            table = (table + table[:, :, ::-1]) / 2
            negative |= negative[:, :, ::-1]
    valid = above_horizon & np.isfinite(table).all(-1)
    table[~valid] = 0
    report = BinReport(
        total=valid.size,
        below_horizon=int(np.count_nonzero(~above_horizon)),
        negative=0,
        non_finite=int(np.count_nonzero(above_horizon & ~valid)),
        clamped=int(np.count_nonzero(negative & valid)),
    )
    _finish(table, valid, source)
    return Measurement(f_r=table, valid=valid, source=source, report=report)


def to_utia_grid(f_r: Evaluate, source: Source) -> AnisotropicMeasurement:
    """Measurement of an anisotropic BRDF: the mean of f_r(wi, wo) and f_r(wo, wi) at the nodes.

    f_r : takes unit wi, wo (n, 3) to linear RGB (n, 3), 1/sr

    Raises
    ------
    MeasurementError
        There is nothing to fit.
    """
    w = polar_grid.directions()
    n = len(w)
    table = f_r(np.repeat(w, n, axis=0), np.tile(w, (n, 1))).reshape(n, n, 3)
    with np.errstate(invalid="ignore"):
        negative = (table < 0).any(-1)
        table = np.maximum(table, 0)
        table = (table + table.transpose(1, 0, 2)) / 2
        negative |= negative.T
    valid = np.isfinite(table).all(-1)
    table[~valid] = 0
    report = ClampReport(
        total=valid.size,
        negative=int(np.count_nonzero(negative & valid)),
        non_finite=int(np.count_nonzero(~valid)),
    )
    _finish(table, valid, source)
    shape = (*polar_grid.GRID, *polar_grid.GRID)
    return AnisotropicMeasurement(
        table.reshape(*shape, 3), valid.reshape(shape), source, report, "linear"
    )


def _finish(table: np.ndarray, valid: np.ndarray, source: Source) -> None:
    """Refuse what is black everywhere, and keep what is not from being changed."""
    if not table.any():
        raise MeasurementError(
            f"{shown_name(source.file_name)}: none of {np.count_nonzero(valid):,} usable values is "
            "above zero, nothing can be fitted to a perfectly black material; download it again"
        )
    for array in (table, valid):
        array.flags.writeable = False


def _tabulated(f_r: Evaluate) -> np.ndarray:
    """f_r (90, 90, 180, 3) at the bin centres."""
    theta_d, phi_d = theta_d_centres()[:, None], phi_d_centres()[None, :]
    table = np.empty((N_THETA_H, N_THETA_D, N_PHI_D, 3))
    for row, theta_h in zip(table, theta_h_centres(), strict=True):
        wi, wo = directions_from_rusinkiewicz(theta_h, theta_d, phi_d)
        row[...] = f_r(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(row.shape)
    return table
