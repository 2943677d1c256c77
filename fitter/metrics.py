# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures that say how good a fit is."""

from __future__ import annotations

import numpy as np

from .geometry import (
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
from .measurement import Measurement
from .model import FactorModel

# What counts as black in the log error, 1/sr.
LOG_FLOOR = 1e-3


def tabulate(model: FactorModel) -> np.ndarray:
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
    cos_i = merl_bins().cos_i[..., None]
    weight = np.where(measurement.valid, merl_solid_angle()[:, :, None], 0)
    ratio = np.log((table * cos_i + LOG_FLOOR) / (measurement.f_r * cos_i + LOG_FLOOR))
    valid = measurement.valid
    error = np.abs(ratio[valid]).mean(-1)
    return float((error * weight[valid]).sum() / weight[valid].sum())
