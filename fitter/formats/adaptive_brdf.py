# SPDX-License-Identifier: GPL-3.0-or-later
"""The adaptive parameterisation of Dupuy and Jakob 2018, evaluated for pairs of directions.

"An Adaptive Parameterization for Efficient Material Acquisition and Rendering" measures where a
microfacet model that was fitted to the backscattering expects something to see. For incidence
(theta_i, phi_i), the half vector m of the pair has the position

    u_m = (sqrt(2 theta_m / pi), (phi_m - phi_i) / (2 pi) + 1/2)

on the unit square (anisotropic: phi_m alone), the density of visible normals `vndf` turns it into
a uniform position u, and the table `rgb` holds the measurement there:

    f_r cos theta_o = rgb(u; phi_i, theta_i) * ndf(u_m) / (4 sigma(u_i))

with ndf and sigma the distribution of normals and the projected area of that microfacet model;
files without `jacobian` hold f_r cos theta_o itself. A table over half or a quarter of the circle
of phi_i (the "reduction" 2 or 4) stands for the rest by symmetry.

Directions are called as in the paper: `incident` is where the light of the measurement came from,
`exitant` where it was seen. Renderers look the table up the other way round, with the viewer as
`incident` (Mitsuba's measured.cpp, pbrt's MeasuredBxDF), which would be the same for reciprocal
data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import HALF_PI, normalized, polar_angle
from .warps import SquareTable, Warp

# Of the map from the unit square to directions; it is 0 where m is the normal.
SMALLEST_JACOBIAN = 1e-6


@dataclass(frozen=True)
class AdaptiveBrdf:
    """A BRDF in the adaptive parameterisation.

    ndf, sigma : functions on the unit square, without parameters
    vndf : warp with the parameters (phi_i, theta_i)
    rgb : three channels, with the same parameters
    isotropic : whether the azimuth of m is counted from that of the incident direction
    reduction : how many times the range of phi_i fits into the circle: 1, 2 or 4
    jacobian : whether the table is to be multiplied by ndf / (4 sigma)
    """

    ndf: SquareTable
    sigma: SquareTable
    vndf: Warp
    rgb: SquareTable
    isotropic: bool
    reduction: int
    jacobian: bool

    def f_r(self, incident: np.ndarray, exitant: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, of unit directions (n, 3); 0 below the horizon.

        Colours out of the gamut of sRGB have negative channels. The tables are multiplied and
        divided as they are: a file's values need not be finite, nor what comes out.
        """
        above = (incident[:, 2] > 0) & (exitant[:, 2] > 0)
        values = np.zeros((len(above), 3))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            f_r_cos = self._f_r_cos(incident[above], exitant[above])
            values[above] = f_r_cos / exitant[above, 2:]
        return values

    def sample(self, incident: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Exitant directions (n, 3) for uniform variates x, y (n,), with the density `pdf`.

        They follow the visible normals, not the measurement; some are below the horizon.
        """
        canonical, mirror = self._mirrored(incident)
        theta_i, phi_i = polar_angle(canonical), _azimuth(canonical)
        u, v = self.vndf.sample(x, y, phi_i, theta_i)
        theta_m, phi_m = u**2 * HALF_PI, (2 * v - 1) * np.pi
        if self.isotropic:
            phi_m = phi_m + phi_i
        sin = np.sin(theta_m)
        m = np.stack([sin * np.cos(phi_m), sin * np.sin(phi_m), np.cos(theta_m)], -1)
        exitant = 2 * (m * canonical).sum(-1, keepdims=True) * m - canonical
        return exitant * mirror

    def pdf(self, incident: np.ndarray, exitant: np.ndarray) -> np.ndarray:
        """Density (n,) of `sample`, 1/sr, of directions above the horizon."""
        incident, exitant, m, place, parameters = self._located(incident, exitant)
        u, theta_m = place[0], polar_angle(m)
        # of half vectors: d omega_m = 2 pi^2 u sin theta_m du dv; of reflections: 4 cos theta_d
        jacobian = 2 * np.pi**2 * u * np.sin(theta_m) * 4 * (incident * m).sum(-1)
        return self.vndf.eval(*place, *parameters) / np.maximum(jacobian, SMALLEST_JACOBIAN)

    def _f_r_cos(self, incident: np.ndarray, exitant: np.ndarray) -> np.ndarray:
        incident, exitant, _, place, parameters = self._located(incident, exitant)
        values = self.rgb.eval(*self.vndf.invert(*place, *parameters), *parameters)
        if self.jacobian:
            phi_i, theta_i = parameters
            area = self.sigma.eval(_position_of_polar(theta_i), _position_of_azimuth(phi_i))
            values = values * (self.ndf.eval(*place) / (4 * area))[:, None]
        return values

    def _located(
        self, incident: np.ndarray, exitant: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple, tuple]:
        """The pair that the table holds in place of this one, and where it holds it.

        Returns incident and exitant, the half vector m, its position on the unit square and the
        parameters (phi_i, theta_i).
        """
        incident, mirror = self._mirrored(incident)
        exitant = exitant * mirror
        m = normalized(incident + exitant)
        theta_i, phi_i = polar_angle(incident), _azimuth(incident)
        phi_m = _azimuth(m) - phi_i if self.isotropic else _azimuth(m)
        place = _position_of_polar(polar_angle(m)), np.mod(_position_of_azimuth(phi_m), 1)
        return incident, exitant, m, place, (phi_i, theta_i)

    def _mirrored(self, incident: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Incident directions as the table has them, and the signs (n, 3) that make them so."""
        if self.reduction < 2:
            return incident, np.ones_like(incident)
        sign_y = np.where(np.signbit(incident[:, 1]), 1.0, -1.0)
        sign_x = np.where(np.signbit(incident[:, 0]), 1.0, -1.0) if self.reduction == 4 else sign_y
        mirror = np.stack([sign_x, sign_y, np.ones_like(sign_y)], -1)
        return incident * mirror, mirror


def _azimuth(directions: np.ndarray) -> np.ndarray:
    return np.arctan2(directions[:, 1], directions[:, 0])


def _position_of_polar(theta: np.ndarray) -> np.ndarray:
    return np.sqrt(theta / HALF_PI)


def _position_of_azimuth(phi: np.ndarray) -> np.ndarray:
    return (phi + np.pi) / (2 * np.pi)
