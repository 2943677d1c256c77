# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo over what was measured, and how far a model is from that of the data.

The albedo of a view angle is the integral of f cos theta_i over the bins that hold a measurement;
the light that falls on others is left out of data and model alike. It is linear in d, s, D and F
and quadratic in G, and a view sees some thousand bins, so it can be part of what the joint steps
minimise (`joint`). Errors that have the same sign over many directions hardly count in the squares
of eq. 2, but under a soft light they add up to what a picture shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import splines
from .geometry import N_THETA_H, merl_bin_index, merl_bins, theta_h_centres, theta_h_from_index
from .measurement import Measurement
from .model import FactorModel
from .quadrature import HalfVectors

# View angles at which albedos are compared, degrees.
VIEW_ANGLES = np.arange(0, 86, 5.0)

# Azimuths of half vectors over half a turn; the other half is its mirror image.
N_PHI = 48

# For the fit fewer are enough: data and model are summed over the same.
N_PHI_FIT = 24

# Relative errors count as e^2 below this and as e^4 above: what matters is the largest.
TOLERANCE = 0.02

# What the mean of that is worth in units of E.
WORTH = 2.0


def view_bins(
    measurement: Measurement, theta_o: float, n_phi: int = N_PHI
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """MERL bins that a view from theta_o sees, and cos theta_i times their solid angle.

    0 where there is no measurement. Half vectors at the centres of theta_h bins, so that the
    sharpest highlight is seen.
    """
    ring = -2 * np.pi * np.diff(np.cos(theta_h_from_index(np.arange(N_THETA_H + 1))))
    view = HalfVectors.on_rings(theta_h_centres(), ring, n_phi).at_view(theta_o)
    bins = merl_bin_index(view.wi, np.broadcast_to(view.wo, view.wi.shape))
    return bins, view.wi[:, 2] * view.solid_angle * measurement.valid[bins]


def measured_albedo(table: np.ndarray, measurement: Measurement) -> np.ndarray:
    """Directional albedo (views, 3) of a table (90, 90, 180, 3) over bins with a measurement."""
    albedo = np.empty((len(VIEW_ANGLES), 3))
    for row, theta_o in enumerate(np.radians(VIEW_ANGLES)):
        bins, weight = view_bins(measurement, theta_o)
        albedo[row] = weight @ table[bins]
    return albedo


@dataclass(frozen=True)
class AlbedoError:
    """How far models are from the albedo of one measurement; k samples over all views.

    view, bin_h, bin_d : (k,) indices of each sample
    taps_i, taps_o : control points and weights ((k, 4), (k, 4)) of G at theta_i and theta_o
    lobe_weight : (k,) cos theta_i, solid angle and 1 / (cos_i cos_o), what lobes are summed with
    diffuse_weight : (views,) sum of cos theta_i and solid angle
    target : (views, 3) albedo of the data
    """

    view: np.ndarray
    bin_h: np.ndarray
    bin_d: np.ndarray
    taps_i: tuple[np.ndarray, np.ndarray]
    taps_o: tuple[np.ndarray, np.ndarray]
    lobe_weight: np.ndarray
    diffuse_weight: np.ndarray
    target: np.ndarray

    @classmethod
    def of(cls, measurement: Measurement, diffuse_shape: np.ndarray | None = None) -> AlbedoError:
        """Views that see a measurement of light in every channel.

        diffuse_shape : (90, 90, 180) what the diffuse part is multiplied with, for experiments;
            default Lambert's 1
        """
        bins = merl_bins()
        samples, weights, views = [], [], []
        diffuse_weight, target = [], []
        for theta_o in np.radians(VIEW_ANGLES):
            seen, weight = view_bins(measurement, theta_o, N_PHI_FIT)
            albedo = weight @ measurement.f_r[seen]
            if not (albedo > 0).all():
                continue
            some = weight > 0
            views.append(np.full(np.count_nonzero(some), len(target)))
            samples.append(np.stack(seen)[:, some])
            weights.append(weight[some])
            shape = 1 if diffuse_shape is None else diffuse_shape[seen]
            diffuse_weight.append((weight * shape).sum())
            target.append(albedo)
        empty = np.zeros((3, 0), np.intp)
        index = tuple(np.concatenate([empty, *samples], axis=1))
        cos_i, cos_o = bins.cos_i[index], bins.cos_o[index]
        return cls(
            view=np.concatenate([empty[0], *views]),
            bin_h=index[0],
            bin_d=index[1],
            taps_i=splines.catmull_rom_taps(np.arccos(cos_i)),
            taps_o=splines.catmull_rom_taps(np.arccos(cos_o)),
            lobe_weight=np.concatenate([np.zeros(0), *weights]) / (cos_i * cos_o),
            diffuse_weight=np.array(diffuse_weight),
            target=np.array(target).reshape(-1, 3),
        )

    def value(self, model: FactorModel) -> float:
        """WORTH times the mean of e^2 (1 + (e / TOLERANCE)^2) for relative errors e."""
        if not self.target.size:
            return 0.0
        return WORTH * float((self._residual(self.albedo(model))[0] ** 2).mean())

    def albedo(self, model: FactorModel) -> np.ndarray:
        """Albedo (views, 3) of a model over the same bins."""
        shape = self.lobe_weight * self._masking(model, self.taps_i)
        shape *= self._masking(model, self.taps_o)
        values = np.einsum("mk,mck->ck", shape, self._amplitudes(model))
        lobes = [np.bincount(self.view, channel, len(self.target)) for channel in values]
        return np.stack(lobes, -1) + self.diffuse_weight[:, None] * model.diffuse

    def residual_and_jacobian(self, model: FactorModel) -> tuple[np.ndarray, np.ndarray]:
        """Residuals r (n,) with `value` = r . r, and their derivatives (n, 822).

        To the logarithms of D, F, G and s and to d, in the order of `joint`.
        """
        albedo, derivatives = self._albedo_and_derivatives(model)
        residual, slope = self._residual(albedo)
        share = np.sqrt(WORTH / max(self.target.size, 1))
        rows = [d.reshape(self.target.size, np.prod(d.shape[2:])) for d in derivatives]
        flat = np.concatenate(rows, axis=1)
        return share * residual.ravel(), share * slope.reshape(-1, 1) * flat

    def _residual(self, albedo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        error = albedo / self.target - 1
        square = (error / TOLERANCE) ** 2
        root = np.sqrt(1 + square)
        return error * root, (1 + 2 * square) / root / self.target

    def _albedo_and_derivatives(self, model: FactorModel) -> tuple[np.ndarray, list[np.ndarray]]:
        n_views, n_lobes = len(self.target), model.n_lobes
        ndf, fresnel, masking, scale, diffuse = (
            np.zeros((n_views, 3, *factor.shape))
            for factor in (model.ndf, model.fresnel, model.masking, model.scale, model.diffuse)
        )
        masking_i, masking_o = self._masking(model, self.taps_i), self._masking(model, self.taps_o)
        amplitudes = self._amplitudes(model)
        for c in range(3):
            diffuse[:, c, c] = self.diffuse_weight
            for m in range(n_lobes):
                factor = self.lobe_weight * amplitudes[m, c]
                lobe = factor * masking_i[m] * masking_o[m]
                ndf[:, c, m] = self._sums(self.bin_h, lobe)
                fresnel[:, c, c] += self._sums(self.bin_d, lobe)
                scale[:, c, m, c] = np.bincount(self.view, lobe, n_views)
                for taps, other in ((self.taps_i, masking_o), (self.taps_o, masking_i)):
                    for index, weight in zip(*map(np.transpose, taps), strict=True):
                        masking[:, c, m] += self._sums(index, factor * other[m] * weight)
        albedo = scale.sum((2, 3)) + self.diffuse_weight[:, None] * model.diffuse
        return albedo, [ndf, fresnel, masking * model.masking, scale, diffuse]

    def _sums(self, node: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Sum samples (k,) by view and node of a factor: (views, 90)."""
        n_nodes = splines.N_MASKING
        flat = np.bincount(self.view * n_nodes + node, values, len(self.target) * n_nodes)
        return flat.reshape(-1, n_nodes)

    def _amplitudes(self, model: FactorModel) -> np.ndarray:
        """S D F (lobes, 3, k)."""
        lobes = model.scale[:, :, None] * model.ndf[:, self.bin_h][:, None]
        return lobes * model.fresnel[:, self.bin_d]

    @staticmethod
    def _masking(model: FactorModel, taps: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """G (lobes, k); as in the problem, without the bound at 0 between control points."""
        index, weight = taps
        return np.einsum("mkt,kt->mk", model.masking[:, index], weight)
