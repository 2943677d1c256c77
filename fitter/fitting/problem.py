# SPDX-License-Identifier: GPL-3.0-or-later
"""The fitting objective, aggregated: a sweep over 4 million values takes a tenth of a second.

    E(model) = sum_j w_j (f(j) - rho_j)^2 / sum_j w_j rho_j^2          (eq. 2, made relative)

over all valid bins and channels. Three aggregations, the first exact:

- The bins phi_d and pi - phi_d hold the same pair of directions with wi and wo swapped. The model
  is reciprocal, so both become one sample that carries sum w, sum w rho and sum w rho^2.
- Optionally, neighbouring phi_d bins share one sample in the same way (`phi_group`). It is used
  where speed matters more than the last per cent.
- theta_i and theta_o are snapped to `n_angles` bins inside the fit. Then G needs evaluating only
  at the bin centres, and its update needs only sums over (theta_i, theta_o) cells.

What remains is linear algebra on moments: with K_m = u_m(theta_i) u_m(theta_o) and u = G / cos,
a (theta_h, theta_d) cell enters through sum w K_m K_k, sum w rho K_m and sum w K_m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import HALF_PI, N_PHI_D, N_THETA_D, N_THETA_H, merl_bins
from ..measurement import Measurement
from ..models import splines
from ..models.model import FactorModel
from .weights import DEFAULT_WEIGHT, sample_weights

N_CELLS = N_THETA_H * N_THETA_D


@dataclass(frozen=True)
class Moments:
    """Sums over the samples of each (theta_h, theta_d) cell for one set of kernels K (lobes, ...).

    kernel_kernel : (90, 90, lobes, lobes, 3) sum w K_m K_k
    kernel_target : (90, 90, lobes, 3) sum w rho K_m
    kernel : (90, 90, lobes, 3) sum w K_m
    """

    kernel_kernel: np.ndarray
    kernel_target: np.ndarray
    kernel: np.ndarray


class Problem:
    """Weighted samples of one measurement; see the module's description.

    weight, weighted_target : (8100, n_phi, 3) sum w and sum w rho of each sample
    cell_weight, cell_target : (90, 90, 3) their sums over each cell
    target_energy : sum w rho^2 over everything, what E is relative to
    unreachable : the part of E that no model can take away: values that differ within a sample
        (wi and wo swapped, for one), and the noise of the samples
    bin_i, bin_o : (8100, n_phi) angle bins of theta_i and theta_o
    basis : (n_angles, 90) takes control points of G to u = G / cos at the bin centres
    """

    def __init__(
        self,
        measurement: Measurement,
        *,
        weight: str = DEFAULT_WEIGHT,
        phi_group: int = 1,
        n_angles: int = 360,
    ) -> None:
        n_phi = N_PHI_D // 2 // phi_group
        bins = merl_bins()
        self.n_angles = n_angles
        # side by side, for `moments` to sum both at once
        self._both = np.empty((N_CELLS, n_phi, 6))
        self.weight, self.weighted_target = self._both[..., :3], self._both[..., 3:]
        self.target_energy = 0.0
        for channel, w in enumerate(sample_weights(measurement, weight)):
            rho = measurement.f_r[..., channel]
            self.target_energy += float((w * rho * rho).sum())
            self.weight[..., channel] = _aggregate(w, n_phi)
            self.weighted_target[..., channel] = _aggregate(w * rho, n_phi)
        seen = self.weight > 0
        mean = self.weighted_target / np.where(seen, self.weight, 1)
        self._within = self.target_energy - float((self.weighted_target * mean).sum())
        self.unreachable = (self._within + self._noise(mean, seen)) / self.target_energy
        self.cell_weight = self.weight.sum(1).reshape(N_THETA_H, N_THETA_D, 3)
        self.cell_target = self.weighted_target.sum(1).reshape(N_THETA_H, N_THETA_D, 3)

        # the middle bin of a group stands for it; groups have an odd number of bins
        representative = slice(phi_group // 2, N_PHI_D // 2, phi_group)
        self.bin_i = angle_bins(bins.cos_i[:, :, representative], n_angles)
        self.bin_o = angle_bins(bins.cos_o[:, :, representative], n_angles)
        self._bin_pair = (self.bin_i * n_angles + self.bin_o).ravel()
        self._channel_weight = np.ascontiguousarray(np.moveaxis(self.weight, -1, 0))
        self._channel_mean = np.ascontiguousarray(np.moveaxis(mean, -1, 0))
        cell = np.arange(N_CELLS)[:, None]
        self._angle_bins = [
            [(rows * n_angles + bins).ravel() for bins in (self.bin_i, self.bin_o)]
            for rows in (cell // N_THETA_D, cell % N_THETA_D)
        ]
        theta = (np.arange(n_angles) + 0.5) / n_angles * HALF_PI
        self.basis = splines.catmull_rom_taps(theta).matrix() / np.cos(theta)[:, None]

    def _noise(self, mean: np.ndarray, seen: np.ndarray) -> float:
        """What second differences along phi_d see of the samples' means; a smooth BRDF has none.

        For independent noise of variance v their mean square is 6 v.
        """
        triple = seen[:, 2:] & seen[:, 1:-1] & seen[:, :-2]
        second = mean[:, 2:] - 2 * mean[:, 1:-1] + mean[:, :-2]
        return float((self.weight[:, 1:-1] * triple * second**2).sum()) / 6

    def kernels(self, masking: np.ndarray) -> np.ndarray:
        """K_m = G_m(i) G_m(o) / (cos_i cos_o) of every sample: (lobes, 8100, n_phi)."""
        u = masking @ self.basis.T
        return np.stack([row[self.bin_i] * row[self.bin_o] for row in u])

    def weight_of(self, channel: int) -> np.ndarray:
        """`weight` of one channel, contiguous: (8100, n_phi)."""
        return self._channel_weight[channel]

    def pair_table(self, values: np.ndarray) -> np.ndarray:
        """Sum samples (8100, n_phi) by their bins of theta_i and theta_o: (n_angles, n_angles)."""
        n = self.n_angles
        return np.bincount(self._bin_pair, values.ravel(), n * n).reshape(n, n)

    def angle_table(self, values: np.ndarray, u: np.ndarray, axis: int) -> np.ndarray:
        """Sum samples by theta_h (axis 0) or theta_d (axis 1) and angle bin: (90, n_angles).

        Each sample counts twice: at its bin of theta_i with weight u(theta_o), and the reverse.
        """
        shape = (N_THETA_H, self.n_angles)
        by_i, by_o = self._angle_bins[axis]
        return (
            np.bincount(by_i, (values * u[self.bin_o]).ravel(), np.prod(shape))
            + np.bincount(by_o, (values * u[self.bin_i]).ravel(), np.prod(shape))
        ).reshape(shape)

    def moments(self, kernels: np.ndarray) -> Moments:
        """Sums over the samples of each cell."""
        n_lobes = len(kernels)
        pairs = [(m, k) for m in range(n_lobes) for k in range(m, n_lobes)]
        rows = np.empty((N_CELLS, len(pairs) + n_lobes, kernels.shape[-1]))
        for row, (m, k) in enumerate(pairs):
            np.multiply(kernels[m], kernels[k], out=rows[:, row])
        rows[:, len(pairs) :] = kernels.transpose(1, 0, 2)
        sums, target_sums = np.split(rows @ self._both, 2, axis=-1)
        kernel_kernel = np.empty((N_CELLS, n_lobes, n_lobes, 3))
        for row, (m, k) in enumerate(pairs):
            kernel_kernel[:, m, k] = kernel_kernel[:, k, m] = sums[:, row]
        shape = (N_THETA_H, N_THETA_D, n_lobes, 3)
        return Moments(
            kernel_kernel=kernel_kernel.reshape(N_THETA_H, N_THETA_D, n_lobes, n_lobes, 3),
            kernel_target=target_sums[:, len(pairs) :].reshape(shape),
            kernel=sums[:, len(pairs) :].reshape(shape),
        )

    def objective(self, model: FactorModel, moments: Moments) -> float:
        """E for a model whose masking belongs to the moments."""
        a, d = amplitudes(model), model.diffuse
        quadratic = 0.0
        for m in range(model.n_lobes):
            for k in range(m, model.n_lobes):
                both = a[:, :, m] * a[:, :, k]
                quadratic += (1 + (m < k)) * np.vdot(both, moments.kernel_kernel[:, :, m, k])
        cross = np.vdot(a, moments.kernel_target) - np.einsum("hdmc,hdmc,c", a, moments.kernel, d)
        constant = (d * d * self.cell_weight - 2 * d * self.cell_target).sum()
        error = self.target_energy + quadratic - 2 * cross + constant
        # a difference of large sums: rounding takes that of a perfect fit below zero
        return float(max(error, 0.0) / self.target_energy)

    def objective_of(self, model: FactorModel) -> float:
        """E of any model, sample by sample: quicker than its moments if nothing else needs them."""
        kernels = self.kernels(model.masking)
        a = amplitudes(model).reshape(N_CELLS, model.n_lobes, 3)
        error = self._within
        for c in range(3):
            f = model.diffuse[c] - self._channel_mean[c]
            for m in range(model.n_lobes):
                f += a[:, m, c, None] * kernels[m]
            error += np.einsum("xp,xp,xp", f, f, self._channel_weight[c])
        return float(max(error, 0.0) / self.target_energy)


def amplitudes(model: FactorModel) -> np.ndarray:
    """a_mc = s_mc D_m F_c of every cell: (90, 90, lobes, 3); the lobe's value is a_mc K_m."""
    return (
        model.ndf.T[:, None, :, None]
        * model.fresnel.T[None, :, None, :]
        * model.scale[None, None, :, :]
    )


def _aggregate(values: np.ndarray, n_phi: int) -> np.ndarray:
    """Sum (90, 90, 180) over the two bins of a pair and over groups of pairs: (8100, n_phi)."""
    half = N_PHI_D // 2
    folded = values[:, :, :half] + values[:, :, : half - 1 : -1]
    return folded.reshape(N_CELLS, n_phi, half // n_phi).sum(-1)


def angle_bins(cosine: np.ndarray, n_angles: int) -> np.ndarray:
    """Which of n_angles bins over 0 to 90 degrees cosines (90, 90, k) fall into: (8100, k)."""
    theta = np.arccos(np.clip(cosine, 0, 1))
    index = np.minimum((theta / HALF_PI * n_angles).astype(np.intp), n_angles - 1)
    return index.reshape(N_CELLS, -1)
