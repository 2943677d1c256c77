# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of Cycles that measured lobes are approximated with, as numpy functions.

A closure's value is f cos(theta_i), as Cycles evaluates it, for unit directions in the local frame
(geometry.py) with wo in the x-z plane. Every closure is linear in a few numbers, its columns:

- ``ggx`` and ``beckmann``: generalized_schlick_bsdf with exponent 5. Two columns, the reflectance
  at normal incidence and at grazing: F = F0 (1 - s) + F90 s with s = (1 - cos theta_d)^5. Cycles
  clamps or mispicks negative ones, so both must be >= 0.
- ``phong_ramp``: eight columns, the colours of a ramp over c = cos^exponent of the angle to the
  mirror direction of wo about the closure's own normal. Not clamped by Cycles: any sign.
- ``diffuse_ramp``: eight columns, the colours of a ramp over cos(theta_i); any sign.

tests/render/test_closures.py renders each of them and compares.

Sources: Cycles, kernel/closure/bsdf_microfacet.h, bsdf_phong_ramp.h and bsdf_diffuse_ramp.h; Heitz
2014, "Understanding the masking-shadowing function" (height-correlated Smith term, eq. 99); Heitz
and d'Eon 2014, "Importance sampling microfacet-based BSDFs using the distribution of visible
normals".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import HALF_PI

RAMP_COLOURS = 8
SCHLICK_EXPONENT = 5

LEAST_COSINE = 1e-9  # to divide by


@dataclass(frozen=True)
class Closure:
    """One entry of a dictionary of closures.

    kind : "ggx", "beckmann", "phong_ramp" or "diffuse_ramp"
    parameter : alpha of the microfacet kinds, exponent of the phong ramp, else 0
    lean : how far the normal of a phong ramp is turned within the plane of incidence. 0: the ramp
        surrounds the mirror direction. 0 to 1: turned by that share of theta_o towards the viewer;
        1 is retroreflection. -1 to 0: away from the viewer, so that the mirror direction moves by
        that share of its way to the horizon.
    """

    kind: str
    parameter: float = 0.0
    lean: float = 0.0

    @property
    def signed(self) -> bool:
        """Whether the columns may be negative."""
        return self.kind in ("phong_ramp", "diffuse_ramp")

    @property
    def n_columns(self) -> int:
        """Numbers in which the closure is linear."""
        return RAMP_COLOURS if self.signed else 2

    def columns(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Values (n_columns, n) of f cos(theta_i), 1/sr, for wi (n, 3) and one wo (3,)."""
        if self.kind == "diffuse_ramp":
            return _hats(np.clip(wi[:, 2], 0, 1)) * (wi[:, 2] > 0) / np.pi
        if self.kind == "phong_ramp":
            cos_power, cos_i = self._phong(wi, wo)
            # Cycles' norm (n + 2) / 2 pi
            return _hats(cos_power) * (cos_power * cos_i * (self.parameter + 2) / (2 * np.pi))
        value = _microfacet(self.kind, self.parameter, wi, wo)
        rise = (1 - np.clip(_cos_d(wi, wo), 0, 1)) ** SCHLICK_EXPONENT
        return np.stack([value * (1 - rise), value * rise])

    def density(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Density (n,), 1/sr, with which Cycles samples wi from the closure; 0 below the horizon.

        Microfacets are sampled by the normals that wo sees (Heitz and d'Eon 2014): the density of h
        is D (h . wo) / (cos_o (1 + lambda_o)), that of wi is it over 4 (h . wo).
        """
        if self.kind == "diffuse_ramp":
            return np.maximum(wi[:, 2], 0) / np.pi
        if self.kind == "phong_ramp":
            return self._phong(wi, wo)[0] * (self.parameter + 1) / (2 * np.pi)
        ndf, cos_o = _ndf(self.kind, self.parameter, wi + wo), max(wo[2], LEAST_COSINE)
        visible = 1 / (1 + _smith_lambda(self.kind, self.parameter, cos_o))
        return np.where(wi[:, 2] > 0, ndf * visible / (4 * cos_o), 0)

    def tilt(self, theta_o: float) -> float:
        """Angle of the closure's normal from the surface's, radians, positive towards wo."""
        return self.lean * (theta_o if self.lean > 0 else (HALF_PI - theta_o) / 2)

    def _phong(self, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """cos^exponent to the mirror direction and cosine to the closure's normal, (n,) each."""
        tilt = self.tilt(np.arctan2(wo[0], wo[2]))
        normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        mirrored = 2 * (wo @ normal) * normal - wo
        cos_i, cos_mirror = wi @ normal, wi @ mirrored
        inside = (cos_i > 0) & (cos_mirror > 0) & (wi[:, 2] > 0)
        return np.where(inside, np.maximum(cos_mirror, 0) ** self.parameter, 0), cos_i


def _hats(position: np.ndarray) -> np.ndarray:
    """Shares (8, n) of each colour of a ramp at positions 0..1."""
    nodes = np.arange(RAMP_COLOURS)[:, None]
    return np.maximum(1 - np.abs(position * (RAMP_COLOURS - 1) - nodes), 0)


def _cos_d(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.linalg.norm(wi + wo, axis=1) / 2


def _microfacet(kind: str, alpha: float, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """D G / (4 cos_o), the microfacet model without Fresnel, times cos_i; 0 below the horizon."""
    cos_i, cos_o = np.maximum(wi[:, 2], LEAST_COSINE), max(wo[2], LEAST_COSINE)
    masking = 1 / (1 + _smith_lambda(kind, alpha, cos_i) + _smith_lambda(kind, alpha, cos_o))
    return np.where(wi[:, 2] > 0, _ndf(kind, alpha, wi + wo) * masking / (4 * cos_o), 0)


def _ndf(kind: str, alpha: float, h: np.ndarray) -> np.ndarray:
    """D (n,), 1/sr, of half vectors h (n, 3) of any length."""
    squared = (h * h).sum(1)
    sin2 = (h[:, 0] ** 2 + h[:, 1] ** 2) / squared
    cos2 = np.maximum(h[:, 2] ** 2 / squared, 1e-12)
    if kind == "ggx":
        return alpha**2 / (np.pi * (sin2 + alpha**2 * cos2) ** 2)
    return np.exp(-sin2 / (cos2 * alpha**2)) / (np.pi * alpha**2 * cos2**2)


def _smith_lambda(kind: str, alpha: float, cosine: np.ndarray | float) -> np.ndarray:
    alpha_tan2 = alpha**2 * np.maximum(1 / np.square(cosine) - 1, 0)
    if kind == "ggx":
        return (np.sqrt(1 + alpha_tan2) - 1) / 2
    # the rational fit that Cycles uses
    a = 1 / np.sqrt(np.maximum(alpha_tan2, 0.39))
    fitted = ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a)
    return np.where(alpha_tan2 < 0.39, 0, fitted)
