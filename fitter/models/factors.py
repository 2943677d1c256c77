# SPDX-License-Identifier: GPL-3.0-or-later
"""What the isotropic and the anisotropic factor model share (Peng, Zheng, Lv 2017, eqs. 3 and 4).

    f_c(wi, wo) = d_c + sum_m s_mc D_m(h) F_c(theta_d) G_m(wi) G_m(wo) / (cos theta_i cos theta_o)

for colour channel c and lobe m; f in 1/sr, without the cosine of the rendering equation. D and G
are shared by the channels, F by the lobes. The models differ in the tables behind D and G.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self, TypeVar

import numpy as np

from ..geometry import HALF_PI, N_THETA_D, half_angles

N_LOBES = 3


@dataclass(frozen=True)
class Factors(ABC):
    """Factors of a model; every number is finite and not negative.

    diffuse : (3,) d_c, 1/sr
    scale : (lobes, 3) s_mc
    ndf : (lobes, ...) D_m at the nodes that the model says
    masking : (lobes, ...) G_m at the nodes that the model says
    fresnel : (3, 90) F_c at geometry.theta_d_centres()

    kind : "isotropic" or "anisotropic", as parameter files name it

    In the gauge that `normalized` gives, every D_m, G_m and F_c has maximum 1 and the energy is in
    scale.
    """

    kind: ClassVar[str]

    diffuse: np.ndarray
    scale: np.ndarray
    ndf: np.ndarray
    masking: np.ndarray
    fresnel: np.ndarray

    @abstractmethod
    def ndf_width(self) -> np.ndarray:
        """Width (lobes,) of each D, comparable within a model."""

    @abstractmethod
    def _ndf_at(self, theta_h: np.ndarray, half: np.ndarray) -> np.ndarray:
        """D_m (lobes, n) at half vectors of any length (n, 3) and their polar angles (n,)."""

    @abstractmethod
    def _masking_at(self, w: np.ndarray) -> np.ndarray:
        """G_m (lobes, n) at unit directions (n, 3)."""

    @staticmethod
    def free_numbers(tables: np.ndarray) -> np.ndarray:
        """What a fit may change of a D or G (lobes, ...): (lobes, k)."""
        return tables

    @staticmethod
    def full_tables(free: np.ndarray) -> np.ndarray:
        """Inverse of free_numbers."""
        return free

    @property
    def n_lobes(self) -> int:
        """Number of specular lobes."""
        return len(self.scale)

    @property
    def n_parameters(self) -> int:
        """Count of numbers."""
        return sum(a.size for a in (self.diffuse, self.scale, self.ndf, self.masking, self.fresnel))

    def normalized(self) -> Self:
        """The same function with every factor's maximum 1, the rest pushed into scale.

        Scaling a D or F by t and s by 1/t changes nothing, nor does scaling a G by t and s by
        1/t^2: 9 directions in which the parameters are free. Factors are comparable only in a
        fixed gauge.
        """

        def maximum(factor: np.ndarray) -> np.ndarray:
            peak = factor.max(axis=tuple(range(1, factor.ndim)), keepdims=True)
            return np.where(peak > 0, peak, 1)

        ndf_peak, masking_peak, fresnel_peak = map(maximum, (self.ndf, self.masking, self.fresnel))
        lobe_peak = (ndf_peak * masking_peak**2).reshape(-1, 1)
        return replace(
            self,
            ndf=self.ndf / ndf_peak,
            masking=self.masking / masking_peak,
            fresnel=self.fresnel / fresnel_peak,
            scale=self.scale * lobe_peak * fresnel_peak[:, 0],
        )

    def sorted_by_width(self) -> Self:
        """The same function with the lobes ordered from the narrowest D to the widest."""
        order = np.argsort(self.ndf_width(), kind="stable")
        return replace(
            self, scale=self.scale[order], ndf=self.ndf[order], masking=self.masking[order]
        )

    def evaluate_fresnel(self, theta_d: np.ndarray) -> np.ndarray:
        """F_c at angles (n,): (3, n); linear, constant beyond the first and last bin centre."""
        return interpolate_linearly(self.fresnel, theta_d / HALF_PI * N_THETA_D - 0.5)

    def lobe_values(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Each lobe's share of f_r (lobes, n, 3), 1/sr, for unit directions (n, 3).

        Exactly symmetric in wi and wo. Zero where either direction is not above the horizon.
        """
        theta_h, theta_d = half_angles(wi, wo)
        cos_product = wi[:, 2] * wo[:, 2]
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        masking = self._masking_at(wi) * self._masking_at(wo)
        shape = self._ndf_at(theta_h, wi + wo) * masking / np.where(above, cos_product, np.inf)
        return self.scale[:, None, :] * shape[:, :, None] * self.evaluate_fresnel(theta_d).T

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        return np.where(above[:, None], self.diffuse + self.lobe_values(wi, wo).sum(0), 0)


AnyFactors = TypeVar("AnyFactors", bound=Factors)


def interpolate_linearly(table: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Rows of table (rows, n) interpolated linearly at positions (k,) in nodes: (rows, k)."""
    position = np.clip(position, 0, table.shape[1] - 1)
    left = np.minimum(position.astype(np.intp), table.shape[1] - 2)
    t = position - left
    return table[:, left] * (1 - t) + table[:, left + 1] * t
