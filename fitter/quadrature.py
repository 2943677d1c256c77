# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions and solid angles for integrals over the hemisphere at a fixed view angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import HALF_PI

# Light directions this close to the horizon carry nothing and divide by nothing.
LEAST_COS_I = 1e-3


@dataclass(frozen=True)
class ViewQuadrature:
    """Points for integrals of a function that is even in y, over wi at one wo in the x-z plane.

    wi : (n, 3) unit, above the horizon, half of them mirrored away
    wo : (3,)
    solid_angle : (n,) sr; sums to about 2 pi over the whole hemisphere
    """

    wi: np.ndarray
    wo: np.ndarray
    solid_angle: np.ndarray


def view_quadrature(theta_o: float, n_theta: int, n_phi: int) -> ViewQuadrature:
    """Points that lie as densely as the bins of theta_h on the MERL grid.

    Gauss-Legendre in the square root of theta_h, midpoints over half the azimuths of h.
    """
    points, gauss = np.polynomial.legendre.leggauss(n_theta)
    root = (points + 1) / 2
    theta_h = root**2 * HALF_PI
    phi = (np.arange(n_phi) + 0.5) / n_phi * np.pi
    sin_h = np.sin(theta_h)[:, None]
    h = np.stack(
        np.broadcast_arrays(sin_h * np.cos(phi), sin_h * np.sin(phi), np.cos(theta_h)[:, None]), -1
    ).reshape(-1, 3)
    measure = np.sin(theta_h) * (HALF_PI * 2 * root * gauss / 2) * (2 * np.pi / n_phi)
    wo = np.array([np.sin(theta_o), 0.0, np.cos(theta_o)])
    cos_d = h @ wo
    wi = 2 * cos_d[:, None] * h - wo
    keep = (cos_d > 0) & (wi[:, 2] > LEAST_COS_I)
    # dwi = 4 cos(theta_d) dh
    return ViewQuadrature(wi[keep], wo, (np.repeat(measure, n_phi) * 4 * cos_d)[keep])
