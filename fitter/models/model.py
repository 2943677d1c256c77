# SPDX-License-Identifier: GPL-3.0-or-later
"""The isotropic three-lobe factor model (Peng, Zheng, Lv 2017, eq. 3).

D depends on theta_h and G on theta alone: 3 + 9 + 270 + 270 + 270 = 822 numbers.

Between its nodes D is linear over the square-root axis of theta_h, F is linear over theta_d (both
constant beyond their first and last bin centres) and G is a Catmull-Rom curve over theta. The OSL
shader in osl/ evaluates the same function.
"""

from __future__ import annotations

import numpy as np

from ..geometry import HALF_PI, N_THETA_H, index_from_theta_h, polar_angle
from ..taps import Taps
from . import splines
from .factors import Factors


class FactorModel(Factors):
    """The model; see Factors for diffuse, scale and fresnel.

    ndf : (lobes, 90) D_m at geometry.theta_h_centres()
    masking : (lobes, 90) G_m at splines.masking_nodes()
    """

    kind = "isotropic"

    def ndf_width(self) -> np.ndarray:
        """Width (lobes,): the mean position on the square-root axis, weighted by D cos."""
        centres = np.arange(N_THETA_H) + 0.5
        theta_h = (centres / N_THETA_H) ** 2 * HALF_PI
        # solid angle of a bin: sin(theta_h) dtheta_h with dtheta_h proportional to the position
        weight = self.ndf * np.cos(theta_h) * np.sin(theta_h) * centres
        total = weight.sum(1)
        return (weight * centres).sum(1) / np.where(total > 0, total, 1)

    def evaluate_ndf(self, theta_h: np.ndarray) -> np.ndarray:
        """D_m at angles (n,): (lobes, n)."""
        return _ndf_taps(theta_h).of(self.ndf)

    def evaluate_masking(self, theta: np.ndarray) -> np.ndarray:
        """G_m at angles (n,): (lobes, n)."""
        return splines.evaluate(self.masking, theta)

    @staticmethod
    def _ndf_taps(theta_h: np.ndarray, half: np.ndarray) -> Taps:
        return _ndf_taps(theta_h)

    @staticmethod
    def _masking_taps(w: np.ndarray) -> Taps:
        return splines.catmull_rom_taps(polar_angle(w))

    def _ndf_through(self, taps: Taps) -> np.ndarray:
        return taps.of(self.ndf)

    def _masking_through(self, taps: Taps) -> np.ndarray:
        return splines.through(taps, self.masking)


def _ndf_taps(theta_h: np.ndarray) -> Taps:
    return Taps.linear(index_from_theta_h(theta_h) - 0.5, N_THETA_H)
