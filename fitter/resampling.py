# SPDX-License-Identifier: GPL-3.0-or-later
"""Isotropic measurements of other shapes, tabulated on the MERL grid.

Every bin holds the value at its centre, which is what a fit compares with: the model is evaluated
there too. Files that hold both directions of a pair apart are not quite reciprocal, and a bin then
holds the mean of the two.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .errors import MeasurementError
from .geometry import (
    N_PHI_D,
    N_THETA_D,
    N_THETA_H,
    directions_from_rusinkiewicz,
    merl_bins,
    phi_d_centres,
    theta_d_centres,
    theta_h_centres,
)
from .measurement import BinReport, Measurement, Source

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


def to_merl_grid(f_r: Evaluate, source: Source, *, reciprocal: bool = True) -> Measurement:
    """Measurement of a BRDF that is known for all pairs of directions.

    Negative channels, of colours out of gamut, become 0 and are counted; a bin that is not finite
    in some channel is masked.

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
    if not table.any():
        raise MeasurementError(
            f"{source.file_name}: no bin of {report.usable:,} usable ones is above zero, nothing "
            "can be fitted to a perfectly black material; download it again"
        )
    for array in (table, valid):
        array.flags.writeable = False
    return Measurement(f_r=table, valid=valid, source=source, report=report)


def _tabulated(f_r: Evaluate) -> np.ndarray:
    """f_r (90, 90, 180, 3) at the bin centres."""
    theta_d, phi_d = theta_d_centres()[:, None], phi_d_centres()[None, :]
    table = np.empty((N_THETA_H, N_THETA_D, N_PHI_D, 3))
    for row, theta_h in zip(table, theta_h_centres(), strict=True):
        wi, wo = directions_from_rusinkiewicz(theta_h, theta_d, phi_d)
        row[...] = f_r(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(row.shape)
    return table
