# SPDX-License-Identifier: GPL-3.0-or-later
"""Slices through a BRDF in the plane of incidence, as polar plots show them."""

from __future__ import annotations

import numpy as np

from ..measurement import Measurement
from .metrics import Brdf

# Angles of incidence, and theta_o in the plane of incidence, radians.
INCIDENCE = np.radians([10.0, 30.0, 60.0, 80.0])
THETA_O = np.radians(np.arange(-89.5, 90, 0.5))

# Out of that plane by this azimuth, so that rounding does not choose between the bins of phi_d at
# both of its ends, which hold the same pair with wi and wo swapped.
OUT_OF_PLANE = 1e-6


def model_slices(model: Brdf) -> np.ndarray:
    """f_r (incidence, theta_o, 3) in the plane of incidence; wi lies at negative theta_o."""
    return np.stack([model.f_r(*_pairs(theta_i, 0.0)) for theta_i in INCIDENCE])


def measured_slices(measurement: Measurement) -> np.ndarray:
    """The same of the data: the mean of both orders of a pair where both were measured."""
    slices = []
    for theta_i in INCIDENCE:
        values = []
        for azimuth in (-OUT_OF_PLANE, OUT_OF_PLANE):
            wi, wo = _pairs(theta_i, azimuth)
            valid = measurement.lookup_valid(wi, wo)[:, None]
            values.append(np.where(valid, measurement.lookup(wi, wo), np.nan))
        known = ~np.isnan(values)
        total = np.where(known, values, 0).sum(0)
        slices.append(np.where(known.any(0), total / np.maximum(known.sum(0), 1), np.nan))
    return np.stack(slices)


def _pairs(theta_i: float, azimuth: float) -> tuple[np.ndarray, np.ndarray]:
    """Wi and wo (n, 3) for all of THETA_O: wi leans to -x, so the mirror direction is at +."""
    wi = np.array([-np.sin(theta_i), 0.0, np.cos(theta_i)])
    sin = np.sin(THETA_O)
    wo = np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), np.cos(THETA_O)], -1)
    return np.broadcast_to(wi, wo.shape), wo
