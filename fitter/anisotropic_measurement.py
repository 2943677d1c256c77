# SPDX-License-Identifier: GPL-3.0-or-later
"""A measured anisotropic BRDF in memory, whatever file it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import polar_grid
from .geometry import azimuth, polar_angle
from .measurement import Source
from .taps import Taps


@dataclass(frozen=True)
class ClampReport:
    """How many pairs of directions of a file were changed or left out; a pair counts once."""

    total: int
    negative: int
    non_finite: int

    @property
    def usable(self) -> int:
        """Pairs that hold a measurement; negative ones count as black."""
        return self.total - self.non_finite


@dataclass(frozen=True)
class AnisotropicMeasurement:
    """A BRDF on the grid of polar_grid, light by viewer.

    f_r : (6, 48, 6, 48, 3), theta_i, phi_i, theta_o, phi_o; 1/sr, linear RGB; 0 where not valid
    valid : (6, 48, 6, 48) mask of the pairs that hold a measurement
    encoding : how the file's numbers were taken, a name in utia.ENCODINGS
    """

    f_r: np.ndarray
    valid: np.ndarray
    source: Source
    report: ClampReport
    encoding: str

    def lookup(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """f_r (n, 3) interpolated linearly in all four angles at unit directions (n, 3).

        Constant beyond 75 degrees.
        """
        table = self.f_r.reshape(polar_grid.N_NODES, polar_grid.N_NODES, 3)
        taps_i, taps_o = _clamped_taps(wi), _clamped_taps(wo)
        return sum(
            table[index_i, index_o] * (weight_i * weight_o)[:, None]
            for index_i, weight_i in zip(taps_i.index, taps_i.weight, strict=True)
            for index_o, weight_o in zip(taps_o.index, taps_o.weight, strict=True)
        )


def _clamped_taps(w: np.ndarray) -> Taps:
    return polar_grid.taps(np.minimum(polar_angle(w), polar_grid.LAST_THETA), azimuth(w))
