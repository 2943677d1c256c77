# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions and solid angles for integrals over the hemisphere at a fixed view angle.

Points are half vectors, as dense as the function is sharp; at a view direction each becomes the
light direction that it mirrors to, with dwi = 4 cos(theta_d) dh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import HALF_PI

# Light directions this close to the horizon carry nothing and divide by nothing.
LEAST_COS_I = 1e-3


@dataclass(frozen=True)
class ViewQuadrature:
    """Points for integrals over wi at one wo.

    For functions that are even in y, with wo in the x-z plane, half of the points may do.

    wi : (n, 3) unit, above the horizon
    wo : (3,)
    solid_angle : (n,) sr; sums to about 2 pi over the whole hemisphere
    """

    wi: np.ndarray
    wo: np.ndarray
    solid_angle: np.ndarray

    def turned(self, phi: float) -> ViewQuadrature:
        """The same about the normal, counter-clockwise by phi, radians."""
        cosine, sine = np.cos(phi), np.sin(phi)
        turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
        return ViewQuadrature(self.wi @ turn, self.wo @ turn, self.solid_angle)


@dataclass(frozen=True)
class HalfVectors:
    """Points for integrals over half vectors.

    h : (n, 3) unit, above the horizon; for functions that are even in y, half of them
    solid_angle : (n,) sr; sums to 2 pi
    """

    h: np.ndarray
    solid_angle: np.ndarray

    @classmethod
    def on_rings(
        cls, theta_h: np.ndarray, ring: np.ndarray, n_phi: int, turn: float = np.pi
    ) -> HalfVectors:
        """Midpoints of n_phi azimuths over half a turn, at angles theta_h (n,), radians.

        ring : (n,) solid angle of each ring, over the whole turn, sr
        turn : 2 pi for functions that are not even in y
        """
        phi = (np.arange(n_phi) + 0.5) / n_phi * turn
        sin_h, cos_h = np.sin(theta_h)[:, None], np.cos(theta_h)[:, None]
        points = np.broadcast_arrays(sin_h * np.cos(phi), sin_h * np.sin(phi), cos_h)
        return cls(np.stack(points, -1).reshape(-1, 3), np.repeat(ring / n_phi, n_phi))

    def at_view(self, theta_o: float, least_cos_i: float = 0.0) -> ViewQuadrature:
        """The light directions that wo at theta_o mirrors to, above least_cos_i."""
        return self.seen_from(np.array([np.sin(theta_o), 0.0, np.cos(theta_o)]), least_cos_i)

    def seen_from(self, wo: np.ndarray, least_cos_i: float = 0.0) -> ViewQuadrature:
        """The light directions that a unit wo (3,) mirrors to, above least_cos_i."""
        cos_d = self.h @ wo
        wi = 2 * cos_d[:, None] * self.h - wo
        keep = (cos_d > 0) & (wi[:, 2] > least_cos_i)
        return ViewQuadrature(wi[keep], wo, (4 * cos_d * self.solid_angle)[keep])


def view_quadrature(
    theta_o: float, n_theta: int, n_phi: int, turn: float = np.pi
) -> ViewQuadrature:
    """Points that lie as densely as the bins of theta_h on the MERL grid.

    Gauss-Legendre in the square root of theta_h, midpoints over half the azimuths of h, or over
    all of them with a turn of 2 pi.
    """
    points, gauss = np.polynomial.legendre.leggauss(n_theta)
    root = (points + 1) / 2
    theta_h = root**2 * HALF_PI
    ring = 2 * np.pi * np.sin(theta_h) * (HALF_PI * 2 * root * gauss / 2)
    return HalfVectors.on_rings(theta_h, ring, n_phi, turn).at_view(theta_o, LEAST_COS_I)
