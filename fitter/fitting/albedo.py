# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo over what was measured.

The albedo of a view angle is the integral of f cos theta_i over the bins that hold a measurement;
the light that falls on others is left out of data and model alike.

A MERL file tells wi from its mirror image in the plane of wo: their bins are phi_d and pi - phi_d.
Light comes from both sides, so both count.
"""

from __future__ import annotations

import numpy as np

from ..geometry import N_PHI_D, N_THETA_H, merl_bin_index, theta_h_centres, theta_h_from_index
from ..measurement import Measurement
from ..quadrature import HalfVectors

# View angles at which albedos are compared, degrees.
VIEW_ANGLES = np.arange(0, 86, 5.0)

# Azimuths of half vectors over half a turn; the other half is its mirror image.
N_PHI = 48

Bins = tuple[np.ndarray, np.ndarray, np.ndarray]


def half_vectors(n_phi: int) -> HalfVectors:
    """Half vectors at the centres of theta_h bins, so that the sharpest highlight is seen."""
    ring = -2 * np.pi * np.diff(np.cos(theta_h_from_index(np.arange(N_THETA_H + 1))))
    return HalfVectors.on_rings(theta_h_centres(), ring, n_phi)


def mirrored_bins(bins: Bins) -> Bins:
    """The bins of the mirror images in the plane of incidence."""
    bin_h, bin_d, bin_p = bins
    return bin_h, bin_d, N_PHI_D - 1 - bin_p


def measured_albedo(table: np.ndarray, measurement: Measurement) -> np.ndarray:
    """Directional albedo (views, 3) of a table (90, 90, 180, 3) over bins with a measurement."""
    albedo = np.zeros((len(VIEW_ANGLES), 3))
    for row, theta_o in zip(albedo, np.radians(VIEW_ANGLES), strict=True):
        view = half_vectors(N_PHI).at_view(theta_o)
        bins = merl_bin_index(view.wi, np.broadcast_to(view.wo, view.wi.shape))
        weight = view.wi[:, 2] * view.solid_angle / 2
        for side in (bins, mirrored_bins(bins)):
            row += (weight * measurement.valid[side]) @ table[side]
    return albedo
