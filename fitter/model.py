# SPDX-License-Identifier: GPL-3.0-or-later
"""The isotropic three-lobe factor model (Peng, Zheng, Lv 2017, eq. 3).

    f_c(wi, wo) = d_c + sum_m s_mc D_m(theta_h) F_c(theta_d) G_m(theta_i) G_m(theta_o)
                          / (cos theta_i cos theta_o)

for colour channel c and lobe m; f in 1/sr, without the cosine of the rendering equation. D and G
are shared by the channels, F by the lobes: 3 + 9 + 270 + 270 + 270 = 822 numbers.

Between its nodes D is linear over the square-root axis of theta_h, F is linear over theta_d (both
constant beyond their first and last bin centres) and G is a Catmull-Rom curve over theta. The OSL
shader in osl/ evaluates the same function.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import splines
from .geometry import HALF_PI, N_THETA_D, N_THETA_H, half_angles, index_from_theta_h, polar_angle

N_LOBES = 3


@dataclass(frozen=True)
class FactorModel:
    """Factors of the model; every number is finite and not negative.

    diffuse : (3,) d_c, 1/sr
    scale : (lobes, 3) s_mc
    ndf : (lobes, 90) D_m at geometry.theta_h_centres()
    masking : (lobes, 90) G_m at splines.masking_nodes()
    fresnel : (3, 90) F_c at geometry.theta_d_centres()

    In the gauge that `normalized` gives, every row of ndf, masking and fresnel has maximum 1 and
    the energy is in scale.
    """

    diffuse: np.ndarray
    scale: np.ndarray
    ndf: np.ndarray
    masking: np.ndarray
    fresnel: np.ndarray

    @property
    def n_lobes(self) -> int:
        """Number of specular lobes."""
        return len(self.scale)

    @property
    def n_parameters(self) -> int:
        """Count of numbers, 822 with three lobes."""
        return sum(a.size for a in (self.diffuse, self.scale, self.ndf, self.masking, self.fresnel))

    def normalized(self) -> FactorModel:
        """The same function with every factor's maximum 1, the rest pushed into scale.

        Scaling a D or F by t and s by 1/t changes nothing, nor does scaling a G by t and s by
        1/t^2: 9 directions in which the parameters are free. Factors are comparable only in a
        fixed gauge.
        """

        def maximum(factor: np.ndarray) -> np.ndarray:
            peak = factor.max(axis=1)
            return np.where(peak > 0, peak, 1)

        ndf_peak, masking_peak, fresnel_peak = map(maximum, (self.ndf, self.masking, self.fresnel))
        return replace(
            self,
            ndf=self.ndf / ndf_peak[:, None],
            masking=self.masking / masking_peak[:, None],
            fresnel=self.fresnel / fresnel_peak[:, None],
            scale=self.scale * (ndf_peak * masking_peak**2)[:, None] * fresnel_peak,
        )

    def sorted_by_width(self) -> FactorModel:
        """The same function with the lobes ordered from the narrowest D to the widest."""
        order = np.argsort(ndf_width(self.ndf), kind="stable")
        return replace(
            self, scale=self.scale[order], ndf=self.ndf[order], masking=self.masking[order]
        )

    def evaluate_ndf(self, theta_h: np.ndarray) -> np.ndarray:
        """D_m at angles (n,): (lobes, n)."""
        return _linear(self.ndf, index_from_theta_h(theta_h) - 0.5)

    def evaluate_fresnel(self, theta_d: np.ndarray) -> np.ndarray:
        """F_c at angles (n,): (3, n)."""
        return _linear(self.fresnel, theta_d / HALF_PI * N_THETA_D - 0.5)

    def evaluate_masking(self, theta: np.ndarray) -> np.ndarray:
        """G_m at angles (n,): (lobes, n)."""
        return splines.evaluate(self.masking, theta)

    def lobe_values(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Each lobe's share of f_r (lobes, n, 3), 1/sr, for unit directions (n, 3).

        Exactly symmetric in wi and wo. Zero where either direction is not above the horizon.
        """
        theta_h, theta_d = half_angles(wi, wo)
        cos_product = wi[:, 2] * wo[:, 2]
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        masking = self.evaluate_masking(polar_angle(wi)) * self.evaluate_masking(polar_angle(wo))
        shape = self.evaluate_ndf(theta_h) * masking / np.where(above, cos_product, np.inf)
        return self.scale[:, None, :] * shape[:, :, None] * self.evaluate_fresnel(theta_d).T

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        return np.where(above[:, None], self.diffuse + self.lobe_values(wi, wo).sum(0), 0)


def ndf_width(ndf: np.ndarray) -> np.ndarray:
    """Width (lobes,) of each D: the mean position on the square-root axis, weighted by D cos."""
    centres = np.arange(N_THETA_H) + 0.5
    theta_h = (centres / N_THETA_H) ** 2 * HALF_PI
    # solid angle of a bin: sin(theta_h) dtheta_h with dtheta_h proportional to the position
    weight = ndf * np.cos(theta_h) * np.sin(theta_h) * centres
    total = weight.sum(1)
    return (weight * centres).sum(1) / np.where(total > 0, total, 1)


def _linear(table: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Rows of table (rows, n) interpolated linearly at positions (k,) in nodes: (rows, k)."""
    position = np.clip(position, 0, table.shape[1] - 1)
    left = np.minimum(position.astype(np.intp), table.shape[1] - 2)
    t = position - left
    return table[:, left] * (1 - t) + table[:, left + 1] * t
