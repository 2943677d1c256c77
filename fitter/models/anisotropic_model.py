# SPDX-License-Identifier: GPL-3.0-or-later
"""The anisotropic three-lobe factor model (Peng, Zheng, Lv 2017, eq. 4).

D depends on the direction of h and G on a direction, both on the grid of `polar_grid`:
3 + 9 + 864 + 864 + 270 = 2010 numbers. As the 48 numbers at each pole must be equal, 1728 of them
are free.

Between its nodes D is bilinear in theta_h and phi_h, G is bilinear in theta and phi, F is linear
over theta_d. Measurements end at 75 degrees. Beyond, D is constant in theta_h, and G falls linearly
to zero at 90 degrees; cos theta is there within 1.2 % of linear too, so G / cos theta, and the
reflectance with it, stays nearly what it is at 75 degrees: bounded, continuous and not negative.

phi is measured from the tangent, counter-clockwise about the normal. phi_h is arctan2 of the
tangential components of wi + wo, which needs no normalised h and no branch. Near the pole few of
its digits are left, but D depends on it only in proportion to theta_h there. The OSL shader
evaluates the same function.
"""

from __future__ import annotations

import numpy as np

from .. import polar_grid
from ..geometry import azimuth, polar_angle
from ..taps import Taps
from .factors import Factors


class AnisotropicModel(Factors):
    """The model; see Factors for diffuse, scale and fresnel.

    ndf : (lobes, 6, 48) D_m at the nodes of polar_grid, theta_h and phi_h
    masking : (lobes, 6, 48) G_m at the nodes of polar_grid
    """

    kind = "anisotropic"

    @staticmethod
    def free_numbers(tables: np.ndarray) -> np.ndarray:
        """Numbers (lobes, 241) of a D or G (lobes, 6, 48): the pole counts once."""
        return polar_grid.free_numbers(tables)

    @staticmethod
    def full_tables(free: np.ndarray) -> np.ndarray:
        """Inverse of free_numbers."""
        return polar_grid.full_tables(free)

    def ndf_width(self) -> np.ndarray:
        """Width (lobes,): the mean theta_h in radians, weighted by D cos theta_h."""
        theta = np.repeat(polar_grid.theta_nodes(), polar_grid.N_PHI)
        weight = self.ndf.reshape(self.n_lobes, -1) * np.cos(theta) * polar_grid.solid_angles()
        total = weight.sum(1)
        return (weight @ theta) / np.where(total > 0, total, 1)

    def evaluate_ndf(self, theta_h: np.ndarray, phi_h: np.ndarray) -> np.ndarray:
        """D_m at angles (n,): (lobes, n)."""
        return polar_grid.interpolate(self.ndf, np.minimum(theta_h, polar_grid.LAST_THETA), phi_h)

    def evaluate_masking(self, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """G_m at angles (n,): (lobes, n)."""
        return polar_grid.interpolate(self.masking, theta, phi)

    @staticmethod
    def _ndf_taps(theta_h: np.ndarray, half: np.ndarray) -> Taps:
        return polar_grid.taps(np.minimum(theta_h, polar_grid.LAST_THETA), azimuth(half))

    @staticmethod
    def _masking_taps(w: np.ndarray) -> Taps:
        return polar_grid.taps(polar_angle(w), azimuth(w))

    def _ndf_through(self, taps: Taps) -> np.ndarray:
        return taps.of(self.ndf.reshape(self.n_lobes, -1))

    def _masking_through(self, taps: Taps) -> np.ndarray:
        return taps.of(self.masking.reshape(self.n_lobes, -1))
