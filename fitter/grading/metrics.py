# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures that say how good a fit is."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..anisotropic_measurement import AnisotropicMeasurement
from ..fitting.weights import DEFAULT_WEIGHT, sample_weights
from ..geometry import (
    N_PHI_D,
    N_THETA_D,
    N_THETA_H,
    directions_from_rusinkiewicz,
    merl_bins,
    merl_solid_angle,
    phi_d_centres,
    theta_d_centres,
    theta_h_centres,
)
from ..measurement import Measurement

# What counts as black in the log error, 1/sr.
LOG_FLOOR = 1e-3


class Brdf(Protocol):
    """What can be graded: our model and those it is compared with. Reciprocal."""

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""


def tabulate(model: Brdf) -> np.ndarray:
    """f_r (90, 90, 180, 3) at the bin centres of the MERL grid; 0 below the horizon."""
    # phi_d and pi - phi_d swap wi and wo, and the model is reciprocal: half the bins are enough
    half = N_PHI_D // 2
    theta_d, phi_d = theta_d_centres()[:, None], phi_d_centres()[None, :half]
    table = np.empty((N_THETA_H, N_THETA_D, N_PHI_D, 3))
    for row, theta_h in enumerate(theta_h_centres()):
        wi, wo = directions_from_rusinkiewicz(theta_h, theta_d, phi_d)
        values = model.f_r(wi.reshape(-1, 3), wo.reshape(-1, 3))
        table[row, :, :half] = values.reshape(N_THETA_D, half, 3)
    table[:, :, half:] = table[:, :, half - 1 :: -1]
    return table


def mean_log_error(table: np.ndarray, measurement: Measurement) -> float:
    """Mean of |log((f cos_i + 1e-3) / (rho cos_i + 1e-3))| over valid bins, weighted by measure.

    table : f_r (90, 90, 180, 3), 1/sr
    """
    weight = np.where(measurement.valid, merl_solid_angle()[:, :, None], 0)
    return weighted_log_error(table, measurement.f_r, merl_bins().cos_i, weight)


def weighted_log_error(
    f_r: np.ndarray, measured: np.ndarray, cos_i: np.ndarray, weight: np.ndarray
) -> float:
    """Mean of |log((f cos_i + 1e-3) / (rho cos_i + 1e-3))| over channels and weighted samples.

    f_r, measured : (..., 3), 1/sr
    cos_i, weight : (...); samples of weight 0 may hold anything
    """
    seen = weight > 0
    cos_i, weight = cos_i[seen][:, None], weight[seen]
    ratio = np.log((f_r[seen] * cos_i + LOG_FLOOR) / (measured[seen] * cos_i + LOG_FLOOR))
    return float((np.abs(ratio).mean(-1) * weight).sum() / weight.sum())


def relative_objective(
    table: np.ndarray, measurement: Measurement, weight: str = DEFAULT_WEIGHT
) -> float:
    """E of eq. 2 over sum w rho^2, with the values themselves: 1 for a black model.

    The objective that a fit reports snaps theta_i and theta_o to angle bins; here nothing is
    approximated, and models of any kind can be compared.

    table : f_r (90, 90, 180, 3), 1/sr
    weight : a name in weights.WEIGHTS
    """
    error = energy = 0.0
    for channel, w in enumerate(sample_weights(measurement, weight)):
        rho = measurement.f_r[..., channel]
        error += float((w * (table[..., channel] - rho) ** 2).sum())
        energy += float((w * rho**2).sum())
    return error / energy


def numeric_psnr(table: np.ndarray, measurement: Measurement | AnisotropicMeasurement) -> float:
    """PSNR in dB of the values, as Peng et al. 2017 give beside that of pictures.

    10 log10(peak^2 / mean squared error) over valid bins and channels, each bin counted once; the
    peak is the largest measured value. Sharp highlights decide it nearly alone.

    table : f_r in the shape of measurement.f_r, 1/sr
    """
    valid = measurement.valid
    rho = measurement.f_r[valid]
    relative = np.mean(((table[valid] - rho) / rho.max()) ** 2)
    return float(-10 * np.log10(max(relative, 1e-30)))
