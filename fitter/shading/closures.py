# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of Cycles that measured lobes are approximated with, as numpy functions.

A closure's value is f cos(theta_i), as Cycles evaluates it, for unit directions in the local frame
(geometry.py). Every closure is linear in a few numbers, its columns:

- ``ggx`` and ``beckmann``: generalized_schlick_bsdf with exponent 5, isotropic or with two
  roughnesses about a tangent. Two columns, the reflectance at normal incidence and at grazing:
  F = F0 (1 - s) + F90 s with s = (1 - cos theta_d)^5. Cycles clamps or mispicks negative ones, so
  both must be >= 0.
- ``phong_ramp``: eight columns, the colours of a ramp over c = cos^exponent of the angle to the
  mirror direction of wo about the closure's own normal, which may lean with the viewer or stand
  still. Not clamped by Cycles: any sign.
- ``diffuse_ramp``: eight columns, the colours of a ramp over cos(theta_i); any sign.

tests/render/test_closures.py renders each of them and compares.

Sources: Cycles, kernel/closure/bsdf_microfacet.h, bsdf_phong_ramp.h and bsdf_diffuse_ramp.h; Heitz
2014, "Understanding the masking-shadowing function" (height-correlated Smith term, eq. 99); Heitz
and d'Eon 2014, "Importance sampling microfacet-based BSDFs using the distribution of visible
normals".
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from ..geometry import HALF_PI, normalized

KINDS = ("ggx", "beckmann", "phong_ramp", "diffuse_ramp")
RAMP_COLOURS = 8
SCHLICK_EXPONENT = 5

LEAST_COSINE = 1e-9  # to divide by

# How far above the horizon the mirror directions of tilted ramps stay; Cycles bends normals where
# it is less than 0.01.
LEAST_MIRROR_COSINE = 0.03


@dataclass(frozen=True)
class Closure:
    """One entry of a dictionary of closures.

    kind : "ggx", "beckmann", "phong_ramp" or "diffuse_ramp"
    parameter : alpha of the microfacet kinds along their tangent, exponent of the phong ramp, else
        0
    lean : how far the normal of a phong ramp is turned within the plane of incidence. 0: the ramp
        surrounds the mirror direction. 0 to 1: turned by that share of theta_o towards the viewer;
        1 is retroreflection. -1 to 0: away from the viewer, so that the mirror direction moves by
        that share of its way to the horizon.
    across : alpha across the tangent; 0 stands for that along it
    tilt : angle of a phong ramp's normal from the surface's, radians; instead of a lean
    azimuth : of the tangent, or of what the normal is tilted to, radians counter-clockwise from +x
    """

    kind: str
    parameter: float = 0.0
    lean: float = 0.0
    across: float = 0.0
    tilt: float = 0.0
    azimuth: float = 0.0

    @property
    def signed(self) -> bool:
        """Whether the columns may be negative."""
        return self.kind in ("phong_ramp", "diffuse_ramp")

    @property
    def n_columns(self) -> int:
        """Numbers in which the closure is linear."""
        return RAMP_COLOURS if self.signed else 2

    @property
    def alphas(self) -> tuple[float, float]:
        """Roughness of the microfacet kinds along their tangent and across."""
        return self.parameter, self.across or self.parameter

    @property
    def turns_with_the_view(self) -> bool:
        """Whether the closure is the same function at all azimuths of the viewer."""
        return not self.tilt and not self.across

    def columns(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Values (n_columns, n) of f cos(theta_i), 1/sr, for wi (n, 3) and one wo (3,)."""
        if self.kind == "diffuse_ramp":
            return _hats(np.clip(wi[:, 2], 0, 1)) * (wi[:, 2] > 0) / np.pi
        if self.kind == "phong_ramp":
            cos_power, cos_i = self._phong(wi, wo)
            # Cycles' norm (n + 2) / 2 pi
            return _hats(cos_power) * (cos_power * cos_i * (self.parameter + 2) / (2 * np.pi))
        value = self._microfacet(wi, wo)
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
        visible = 1 / (1 + self._smith_lambda(wo))
        return np.where(
            wi[:, 2] > 0, self._ndf(wi + wo) * visible / (4 * max(wo[2], LEAST_COSINE)), 0
        )

    def leaning(self, theta_o: float) -> float:
        """Angle by which the lean turns the normal at a view angle, radians, positive to wo."""
        return self.lean * (theta_o if self.lean > 0 else (HALF_PI - theta_o) / 2)

    def normal(self, wo: np.ndarray) -> np.ndarray:
        """Unit normal (3,) of a phong ramp for a unit wo (3,) above the horizon.

        A tilted one gives way where its mirror direction would be below the horizon: Cycles would
        bend it by a rule of its own, if the material says so.
        """
        if self.tilt:
            return self._tilted_normal(wo)
        sin_o = np.hypot(wo[0], wo[1])
        angle = self.leaning(np.arctan2(sin_o, wo[2]))
        # no direction is the viewer's own at the pole
        towards = wo[:2] / sin_o if sin_o > 0 else np.array([1.0, 0.0])
        return np.append(towards * np.sin(angle), np.cos(angle))

    def _tilted_normal(self, wo: np.ndarray) -> np.ndarray:
        towards = np.array([np.cos(self.azimuth), np.sin(self.azimuth)])
        normal = np.append(towards * np.sin(self.tilt), np.cos(self.tilt))
        mirrored = 2 * (wo @ normal) * normal - wo
        least = min(LEAST_MIRROR_COSINE, wo[2])
        if mirrored[2] < least:
            mirrored[2] = least
            normal = normalized(wo + normalized(mirrored))
        return normal

    def _phong(self, wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """cos^exponent to the mirror direction and cosine to the closure's normal, (n,) each."""
        normal = self.normal(wo)
        cos_o = wo @ normal
        cos_i, cos_mirror = wi @ normal, wi @ (2 * cos_o * normal - wo)
        inside = (cos_i > 0) & (cos_o > 0) & (cos_mirror > 0) & (wi[:, 2] > 0)
        return np.where(inside, np.maximum(cos_mirror, 0) ** self.parameter, 0), cos_i

    def _microfacet(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """D G / (4 cos_o), the microfacet model without Fresnel, times cos_i; 0 below horizon."""
        masking = 1 / (1 + self._smith_lambda(wi) + self._smith_lambda(wo))
        value = self._ndf(wi + wo) * masking / (4 * max(wo[2], LEAST_COSINE))
        return np.where(wi[:, 2] > 0, value, 0)

    def _ndf(self, h: np.ndarray) -> np.ndarray:
        """D (n,), 1/sr, of half vectors h (n, 3) of any length."""
        along, across = self.alphas
        squared = (h * h).sum(1)
        x2, y2 = self._squares(h)
        slope2 = (x2 / along**2 + y2 / across**2) / squared
        cos2 = np.maximum(h[:, 2] ** 2 / squared, 1e-12)
        if self.kind == "ggx":
            return 1 / (np.pi * along * across * (slope2 + cos2) ** 2)
        return np.exp(-slope2 / cos2) / (np.pi * along * across * cos2**2)

    def _smith_lambda(self, w: np.ndarray) -> np.ndarray:
        """Lambda of Smith's masking function (...) at unit directions w (..., 3)."""
        along, across = self.alphas
        x2, y2 = self._squares(w)
        alpha_tan2 = (along**2 * x2 + across**2 * y2) / np.maximum(w[..., 2], LEAST_COSINE) ** 2
        if self.kind == "ggx":
            return (np.sqrt(1 + alpha_tan2) - 1) / 2
        # the rational fit that Cycles uses
        a = 1 / np.sqrt(np.maximum(alpha_tan2, 0.39))
        fitted = ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a)
        return np.where(alpha_tan2 < 0.39, 0, fitted)

    def _squares(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squared components (...) of w (..., 3) along the closure's tangent and across."""
        if not self.azimuth:
            return w[..., 0] ** 2, w[..., 1] ** 2
        cosine, sine = np.cos(self.azimuth), np.sin(self.azimuth)
        along = cosine * w[..., 0] + sine * w[..., 1]
        across = cosine * w[..., 1] - sine * w[..., 0]
        return along**2, across**2


def dumps(closures: Sequence[Closure]) -> str:
    """Closures as text that `loads` reads."""
    return json.dumps([list(vars(closure).values()) for closure in closures])


def loads(text: str) -> tuple[Closure, ...]:
    """Read what `dumps` wrote.

    Raises
    ------
    ValueError
        It is something else.
    """
    rows = json.loads(text)
    try:
        closures = tuple(Closure(kind, *map(float, numbers)) for kind, *numbers in rows)
    except TypeError as error:
        raise ValueError(f"these are no closures: {text[:60]!r}") from error
    for closure in closures:
        least, most = (0, 1e5) if closure.signed else (1e-3, 1)
        if not (
            closure.kind in KINDS
            and least <= closure.parameter <= most
            and 0 <= closure.across <= 1
            and -1 <= closure.lean <= 1
            and 0 <= closure.tilt < HALF_PI
            and isfinite(closure.azimuth)
        ):
            raise ValueError(f"there is no such closure: {closure}")
    return closures


def _hats(position: np.ndarray) -> np.ndarray:
    """Shares (8, n) of each colour of a ramp at positions 0..1."""
    nodes = np.arange(RAMP_COLOURS)[:, None]
    return np.maximum(1 - np.abs(position * (RAMP_COLOURS - 1) - nodes), 0)


def _cos_d(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    return np.linalg.norm(wi + wo, axis=1) / 2
