# SPDX-License-Identifier: GPL-3.0-or-later
"""The fitting objective on the UTIA grid (Peng et al. 2017, eqs. 2 and 4).

    E(model) = sum_j w_j (f(j) - rho_j)^2 / sum_j w_j rho_j^2

over all valid pairs of directions and channels. The model is reciprocal and one at the pole, so the
288 x 288 pairs are 241 x 242 / 2 = 29,161 different ones. Those that the model cannot tell apart
become one sample that carries sum w, sum w rho and sum w rho^2, which changes nothing.

Positions and weights of the interpolations are computed once (taps.py). Sums over samples of
products of two interpolations, which make every normal matrix of the fit, are one bincount over
precomputed index pairs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .. import polar_grid
from ..anisotropic_measurement import AnisotropicMeasurement
from ..fitting.weights import DEFAULT_WEIGHT, WEIGHTS
from ..geometry import azimuth, half_angles
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import fresnel_taps
from ..taps import Taps


@dataclass(frozen=True)
class _TapPairs:
    """Products of two interpolations at every sample: flat index and weight (pairs, n)."""

    shape: tuple[int, int]
    index: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(cls, first: Taps, second: Taps) -> _TapPairs:
        n = first.index.shape[1]
        index = first.index[:, None] * second.size + second.index[None]
        weight = first.weight[:, None] * second.weight[None]
        return cls((first.size, second.size), index.reshape(-1, n), weight.reshape(-1, n))

    def summed(self, values: np.ndarray) -> np.ndarray:
        sums = np.bincount(
            self.index.ravel(), (self.weight * values).ravel(), self.shape[0] * self.shape[1]
        )
        return sums.reshape(self.shape)


class AnisotropicProblem:
    """Weighted samples of one measurement; see the module's description.

    weight, weighted_target : (3, n) sum w and sum w rho of each sample
    target_energy : sum w rho^2 over everything, what E is relative to
    inverse_cosines : (n,) 1 / (cos theta_i cos theta_o)
    half, difference, nodes, one : Taps of D, of F, of log G (at wi and at wo), and of a number
    theta_d : (n,)
    """

    def __init__(
        self, measurement: AnisotropicMeasurement, *, weight: str = DEFAULT_WEIGHT, step: int = 1
    ) -> None:
        """Step : look at every so many azimuths of either direction."""
        directions = polar_grid.directions()[polar_grid.N_PHI - 1 :]
        node_i, node_o = np.triu_indices(polar_grid.N_FREE)
        seen = (np.arange(polar_grid.N_FREE) - 1) % step == 0
        seen[0] = True  # the pole
        kept = seen[node_i] & seen[node_o]
        node_i, node_o = node_i[kept], node_o[kept]
        wi, wo = directions[node_i], directions[node_o]
        measure, total, square = (sums[..., kept] for sums in _aggregated(measurement))
        cosines = wi[:, 2] * wo[:, 2]
        mean = total / np.where(measure > 0, measure, 1)
        level = float((mean * measure * cosines).sum() / (3 * (measure * cosines).sum()))
        compressive = np.stack([WEIGHTS[weight](rho, wi[:, 2], wo[:, 2], level) for rho in mean])
        self.weight = compressive * measure
        self.weighted_target = compressive * total
        self.target_energy = float((compressive * square).sum())
        self.inverse_cosines = 1 / cosines

        theta_h, self.theta_d = half_angles(wi, wo)
        at_once = np.ones((1, len(node_i)))
        self.half = _half_taps(theta_h, azimuth(wi + wo))
        self.difference = fresnel_taps(self.theta_d)
        self.nodes = Taps(polar_grid.N_FREE, np.stack([node_i, node_o]), at_once.repeat(2, axis=0))
        self.one = Taps(1, np.zeros_like(node_i)[None], at_once)
        self._pairs: dict[tuple[Taps, Taps], _TapPairs] = {}

    @cached_property
    def pair_index(self) -> np.ndarray:
        """Flat index (n,) of a sample's pair of nodes in a (241, 241) table."""
        return self.nodes.index[0] * polar_grid.N_FREE + self.nodes.index[1]

    def product_sums(self, first: Taps, second: Taps, values: np.ndarray) -> np.ndarray:
        """Sum over samples of values (n,) times both interpolations: (first.size, second.size)."""
        key = (first, second)
        if key not in self._pairs:
            self._pairs[key] = _TapPairs.of(first, second)
        return self._pairs[key].summed(values)

    def kernels(self, masking: np.ndarray) -> np.ndarray:
        """K_m = G_m(i) G_m(o) / (cos_i cos_o) of every sample (lobes, n), from G (lobes, 6, 48)."""
        free = polar_grid.free_numbers(masking)
        node_i, node_o = self.nodes.index
        return free[:, node_i] * free[:, node_o] * self.inverse_cosines

    def ndf(self, model: AnisotropicModel) -> np.ndarray:
        """D_m of every sample (lobes, n)."""
        return self.half.of(polar_grid.free_numbers(model.ndf))

    def fresnel(self, model: AnisotropicModel) -> np.ndarray:
        """F_c of every sample (3, n)."""
        return self.difference.of(model.fresnel)

    def lobe_values(self, model: AnisotropicModel) -> np.ndarray:
        """Each lobe's share of f at every sample (lobes, 3, n)."""
        shape = self.ndf(model) * self.kernels(model.masking)
        return model.scale[:, :, None] * shape[:, None] * self.fresnel(model)

    def objective_of(self, model: AnisotropicModel) -> float:
        """E of a model."""
        f = model.diffuse[:, None] + self.lobe_values(model).sum(0)
        error = (self.weight * f - 2 * self.weighted_target) * f
        return float((self.target_energy + error.sum()) / self.target_energy)


def _aggregated(measurement: AnisotropicMeasurement) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sums over equal pairs of the measure (n,), of measure x rho and of measure x rho^2 (3, n)."""
    n = polar_grid.N_FREE
    node = polar_grid.free_index()
    low, high = np.minimum.outer(node, node), np.maximum.outer(node, node)
    key = (low * n + high).ravel()
    areas = polar_grid.solid_angles()
    areas = areas / areas.sum()
    measure = (np.outer(areas, areas) * measurement.valid.reshape(len(node), -1)).ravel()
    upper = np.triu_indices(n)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(key, values, n * n).reshape(n, n)[upper]

    channels = [measurement.f_r[..., c].ravel() for c in range(3)]
    return (
        summed(measure),
        np.stack([summed(measure * rho) for rho in channels]),
        np.stack([summed(measure * rho * rho) for rho in channels]),
    )


def _half_taps(theta_h: np.ndarray, phi_h: np.ndarray) -> Taps:
    taps = polar_grid.taps(np.minimum(theta_h, polar_grid.LAST_THETA), phi_h)
    return replace(taps, size=polar_grid.N_FREE, index=polar_grid.free_index()[taps.index])
