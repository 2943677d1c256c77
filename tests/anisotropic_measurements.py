# SPDX-License-Identifier: GPL-3.0-or-later
"""Anisotropic measurements for tests, made of functions of directions."""

import numpy as np

from fitter import polar_grid
from fitter.anisotropic_measurement import AnisotropicMeasurement, ClampReport
from fitter.grading import anisotropic_metrics
from fitter.measurement import Source


def measurement_of(f_r, valid=None):
    """Measurement of a table (6, 48, 6, 48, 3) or of a model."""
    table = f_r if isinstance(f_r, np.ndarray) else anisotropic_metrics.tabulate(f_r)
    shape = (*polar_grid.GRID, *polar_grid.GRID)
    valid = np.ones(shape, bool) if valid is None else valid
    return AnisotropicMeasurement(
        f_r=np.where(valid[..., None], table, 0),
        valid=valid,
        source=Source("planted.bin", "utia-bin", "0" * 64),
        report=ClampReport(valid.size, 0, int((~valid).sum())),
        encoding="linear",
    )


def random_pairs(rng, n):
    """Unit wi and wo (n, 3) above the horizon."""
    z, phi = rng.uniform(0.01, 1, 2 * n), rng.uniform(0, 2 * np.pi, 2 * n)
    sin = np.sqrt(1 - z * z)
    return np.split(np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1), 2)
