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
from ..taps import Taps

N_LOBES = 3


@dataclass(frozen=True)
class PairTaps:
    """Where n pairs of directions lie in the factors of one kind of model.

    ndf, masking_i, masking_o, fresnel : for n points; for one where all share a direction
    cos_product : (n,) cos theta_i cos theta_o, infinite where a direction is below the horizon
    """

    ndf: Taps
    masking_i: Taps
    masking_o: Taps
    fresnel: Taps
    cos_product: np.ndarray


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

    @staticmethod
    @abstractmethod
    def _ndf_taps(theta_h: np.ndarray, half: np.ndarray) -> Taps:
        """Of D at half vectors of any length (n, 3) and their polar angles (n,)."""

    @staticmethod
    @abstractmethod
    def _masking_taps(w: np.ndarray) -> Taps:
        """Of G at unit directions (n, 3)."""

    @abstractmethod
    def _ndf_through(self, taps: Taps) -> np.ndarray:
        """D_m (lobes, n)."""

    @abstractmethod
    def _masking_through(self, taps: Taps) -> np.ndarray:
        """G_m (lobes, n), not below 0."""

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
        return fresnel_taps(theta_d).of(self.fresnel)

    @classmethod
    def pair_taps(cls, wi: np.ndarray, wo: np.ndarray) -> PairTaps:
        """Where unit directions wi (n, 3) and wo (n or 1, 3) lie in models of this kind."""
        theta_h, theta_d = half_angles(wi, wo)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        return PairTaps(
            cls._ndf_taps(theta_h, wi + wo),
            cls._masking_taps(wi),
            cls._masking_taps(wo),
            fresnel_taps(theta_d),
            np.where(above, wi[:, 2] * wo[:, 2], np.inf),
        )

    def lobe_values_through(self, taps: PairTaps) -> np.ndarray:
        """Each lobe's share of f_r (lobes, n, 3), 1/sr, at the pairs of `pair_taps`."""
        masking = self._masking_through(taps.masking_i) * self._masking_through(taps.masking_o)
        shape = self._ndf_through(taps.ndf) * masking / taps.cos_product
        fresnel = taps.fresnel.of(self.fresnel).T
        return self.scale[:, None, :] * shape[:, :, None] * fresnel

    def lobe_values(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Each lobe's share of f_r (lobes, n, 3), 1/sr, for unit directions (n, 3).

        wo : (n, 3), or (1, 3) for all

        Exactly symmetric in wi and wo. Zero where either direction is not above the horizon.
        """
        return self.lobe_values_through(self.pair_taps(wi, wo))

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        return np.where(above[:, None], self.diffuse + self.lobe_values(wi, wo).sum(0), 0)


AnyFactors = TypeVar("AnyFactors", bound=Factors)


def fresnel_taps(theta_d: np.ndarray) -> Taps:
    """Interpolation of F at angles (n,)."""
    return Taps.linear(theta_d / HALF_PI * N_THETA_D - 0.5, N_THETA_D)
