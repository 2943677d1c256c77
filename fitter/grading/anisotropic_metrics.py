# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of fits on the UTIA grid; numeric_psnr of `metrics` takes these tables too."""

from __future__ import annotations

import numpy as np

from .. import polar_grid
from ..anisotropic_measurement import AnisotropicMeasurement
from .metrics import Brdf, weighted_log_error


def tabulate(model: Brdf) -> np.ndarray:
    """f_r (6, 48, 6, 48, 3) at all pairs of nodes."""
    w = polar_grid.directions()
    n = len(w)
    values = model.f_r(np.repeat(w, n, axis=0), np.tile(w, (n, 1)))
    return values.reshape(*polar_grid.GRID, *polar_grid.GRID, 3)


def mean_log_error(table: np.ndarray, measurement: AnisotropicMeasurement) -> float:
    """As metrics.mean_log_error, weighted by the solid angles of both directions.

    table : f_r (6, 48, 6, 48, 3), 1/sr
    """
    n = polar_grid.N_NODES
    areas = polar_grid.solid_angles()
    weight = np.outer(areas, areas) * measurement.valid.reshape(n, n)
    cos_i = np.broadcast_to(polar_grid.directions()[:, 2:], (n, n))
    return weighted_log_error(
        table.reshape(n, n, 3), measurement.f_r.reshape(n, n, 3), cos_i, weight
    )
