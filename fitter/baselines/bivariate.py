# SPDX-License-Identifier: GPL-3.0-or-later
"""The Bivariate model, to compare with: a table over theta_h and theta_d for each channel.

    f_c(wi, wo) = T_c(theta_h, theta_d)

The dependence on phi_d is dropped (Romeiro, Vasilyev, Zickler 2008). With the MERL grid that is
3 x 8100 = 24,300 numbers, none of which has a physical meaning. The best table under the objective
of `problem` is the weighted mean of each cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fitting.problem import Problem
from ..fitting.weights import DEFAULT_WEIGHT
from ..geometry import HALF_PI, N_THETA_D, N_THETA_H, half_angles, index_from_theta_h
from ..measurement import Measurement


@dataclass(frozen=True)
class Bivariate:
    """The model; table (90, 90, 3) at the bin centres of theta_h and theta_d, 1/sr."""

    table: np.ndarray

    @property
    def n_parameters(self) -> int:
        """Count of numbers, 24,300."""
        return self.table.size

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon.

        Bilinear over the square-root axis of theta_h and over theta_d, as FactorModel
        interpolates D and F; constant beyond the outer bin centres.
        """
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        theta_h, theta_d = half_angles(wi, wo)
        h, t = _cell_and_share(index_from_theta_h(theta_h) - 0.5, N_THETA_H)
        d, s = _cell_and_share(theta_d / HALF_PI * N_THETA_D - 0.5, N_THETA_D)
        t, s = t[:, None], s[:, None]
        table = self.table
        value = (1 - t) * ((1 - s) * table[h, d] + s * table[h, d + 1])
        value += t * ((1 - s) * table[h + 1, d] + s * table[h + 1, d + 1])
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        return np.where(above[:, None], value, 0)


def fit(measurement: Measurement, *, weight: str = DEFAULT_WEIGHT) -> Bivariate:
    """The weighted mean of every cell; a cell without data takes the value of the nearest with."""
    # one group of all phi_d: only the sums of each cell are needed
    problem = Problem(measurement, weight=weight, phi_group=N_THETA_D, n_angles=1)
    seen = problem.cell_weight > 0
    table = problem.cell_target / np.where(seen, problem.cell_weight, 1)
    return Bivariate(_filled(table, seen.all(-1)))


def _filled(table: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The table with unseen cells copied from the nearest seen one, counted in bins."""
    known, missing = np.argwhere(seen), np.argwhere(~seen)
    filled = table.copy()
    for cell in missing:
        distance = ((known - cell) ** 2).sum(1)
        filled[tuple(cell)] = table[tuple(known[distance.argmin()])]
    return filled


def _cell_and_share(position: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Left node (k,) and share (k,) of the right one at positions (k,) in nodes."""
    position = np.clip(position, 0, n - 1)
    left = np.minimum(position.astype(np.intp), n - 2)
    return left, position - left
