# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic measurements: analytic BRDFs tabulated on the MERL grid.

For the demo and the tests. Nothing here was measured; whoever shows a sample says that it is
synthetic.

An AnalyticBrdf is the sum of a Lambert term and lobes:

- GgxLobe: weight * F D G / (4 cos_i cos_o) with the GGX distribution and the Smith masking of
  Walter et al. 2007, G = G1(wi) G1(wo), and the Fresnel approximation of Schlick 1994;
- SheenLobe: colour * D / (4 (cos_i + cos_o - cos_i cos_o)) with the distribution of Estevez and
  Kulla 2017, D = (2 + 1/alpha) sin(theta_h)^(1/alpha) / (2 pi), and the denominator of Neubelt
  and Pettineo 2013.

The Lambert term is simply added, which keeps f_r reciprocal; so that no view angle reflects more
than it receives, its albedo is scaled down to what the lobes leave at their brightest view angle.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .errors import NfmError
from .formats import merl, utia
from .geometry import (
    N_PHI_D,
    N_THETA_D,
    N_THETA_H,
    directions_from_rusinkiewicz,
    merl_bins,
    normalized,
    phi_d_centres,
    theta_d_centres,
    theta_h_centres,
)
from .grading import anisotropic_metrics

Color = tuple[float, float, float]

ALBEDO_LIMIT = 0.995  # leaves room for the error of the quadrature
QUADRATURE = 64  # midpoints per axis
VIEW_ANGLES = 48


def _check_alpha(alpha: float) -> None:
    if not (0 < alpha <= 1):
        raise ValueError(f"alpha {alpha}, expected above 0 up to 1")


def _check_color(name: str, color: Color) -> None:
    if len(color) != 3 or not all(0 <= channel <= 1 for channel in color):
        raise ValueError(f"{name} {color}, expected three numbers from 0 to 1")


@dataclass(frozen=True)
class PairAngles:
    """What lobes need of pairs of directions above the horizon; arrays (n,)."""

    cos_i: np.ndarray
    cos_o: np.ndarray
    cos2_h: np.ndarray
    sin2_h: np.ndarray
    cos_d: np.ndarray


def _pair_angles(wi: np.ndarray, wo: np.ndarray) -> PairAngles:
    """Angles of unit directions (n, 3); swapping wi and wo swaps cos_i and cos_o, no more."""
    total = wi + wo
    across = total[:, 0] ** 2 + total[:, 1] ** 2
    along = total[:, 2] ** 2
    length2 = across + along  # (2 cos theta_d)^2, 0 only if both directions are on the horizon
    safe = np.where(length2 > 0, length2, 1)
    cos_d = np.minimum(np.sqrt(length2) / 2, 1)
    return PairAngles(wi[:, 2], wo[:, 2], along / safe, across / safe, cos_d)


@dataclass(frozen=True)
class GgxLobe:
    """Microfacet lobe.

    alpha : roughness of the distribution, above 0 up to 1
    f0 : reflectance of a facet seen head-on, [0, 1] per channel
    weight : factor of the whole lobe, at least 0
    """

    alpha: float
    f0: Color
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        _check_alpha(self.alpha)
        _check_color("f0", self.f0)
        if not (0 <= self.weight < np.inf):
            raise ValueError(f"weight {self.weight}, expected a finite number of at least 0")

    def f_r(self, angles: PairAngles) -> np.ndarray:
        """Value (n, 3), 1/sr."""
        alpha2 = self.alpha**2
        ndf = alpha2 / (np.pi * (alpha2 * angles.cos2_h + angles.sin2_h) ** 2)
        # G1(w) / (2 cos) = 1 / (cos + sqrt(cos^2 + alpha^2 sin^2)): no division by a small cosine
        masking = _smith_over_2_cos(angles.cos_i, alpha2) * _smith_over_2_cos(angles.cos_o, alpha2)
        f0 = np.array(self.f0)
        fresnel = f0 + (1 - f0) * ((1 - angles.cos_d) ** 5)[:, None]
        return fresnel * (self.weight * ndf * masking)[:, None]

    def albedo(self, theta_o: float) -> np.ndarray:
        """Directional albedo (3,) at one view angle, midpoint rule over the half vectors of D."""
        rest, phi, weight = _quadrature()
        theta_m = np.arctan(self.alpha * np.sqrt((1 - rest) / rest))
        m = _spherical(theta_m, phi)
        wo = np.array([np.sin(theta_o), 0.0, np.cos(theta_o)])
        cos_d = m @ wo
        wi = 2 * cos_d[:, None] * m - wo
        keep = (cos_d > 0) & (wi[:, 2] > 0)
        angles = _pair_angles(wi[keep], np.broadcast_to(wo, m.shape)[keep])
        # pdf of wi = D cos_m / (4 cos_d)
        alpha2 = self.alpha**2
        ndf = alpha2 / (np.pi * (alpha2 * angles.cos2_h + angles.sin2_h) ** 2)
        pdf = ndf * np.sqrt(angles.cos2_h) / (4 * angles.cos_d)
        return (weight[keep] * angles.cos_i / pdf) @ self.f_r(angles)


@dataclass(frozen=True)
class SheenLobe:
    """Lobe of fibres that stand up: dark head-on, bright at grazing angles.

    alpha : roughness of the distribution, above 0 up to 1; small is a narrow rim
    color : factor of the whole lobe, [0, 1] per channel
    """

    alpha: float
    color: Color

    def __post_init__(self) -> None:
        """Check the values."""
        _check_alpha(self.alpha)
        _check_color("color", self.color)

    def f_r(self, angles: PairAngles) -> np.ndarray:
        """Value (n, 3), 1/sr."""
        ndf = (2 + 1 / self.alpha) * angles.sin2_h ** (0.5 / self.alpha) / (2 * np.pi)
        product = angles.cos_i * angles.cos_o
        return (ndf / (4 * (angles.cos_i + angles.cos_o - product)))[:, None] * self.color

    def albedo(self, theta_o: float) -> np.ndarray:
        """Directional albedo (3,) at one view angle, midpoint rule over wi."""
        cos_i, phi, weight = _quadrature()
        wi = _spherical(np.arccos(cos_i), phi)
        wo = np.array([np.sin(theta_o), 0.0, np.cos(theta_o)])
        f_r = self.f_r(_pair_angles(wi, np.broadcast_to(wo, wi.shape)))
        return 2 * np.pi * (weight * cos_i) @ f_r


@dataclass(frozen=True)
class AnalyticBrdf:
    """Isotropic, reciprocal BRDF that reflects no more than it receives.

    diffuse : albedo of the Lambert term as wished for, [0, 1] per channel
    lobes : added to it
    """

    diffuse: Color
    lobes: tuple[GgxLobe | SheenLobe, ...] = ()

    def __post_init__(self) -> None:
        """Check the values."""
        _check_color("diffuse", self.diffuse)

    @cached_property
    def lobe_albedo(self) -> np.ndarray:
        """Largest directional albedo (3,) of the lobes together over all view angles."""
        # denser towards the horizon, where the albedo changes fastest
        theta_o = (1 - np.linspace(1, 0.001, VIEW_ANGLES) ** 2) * np.pi / 2
        albedo = sum((np.array([lobe.albedo(t) for t in theta_o]) for lobe in self.lobes), 0.0)
        largest = np.max(np.broadcast_to(albedo, (VIEW_ANGLES, 3)), axis=0)
        if (largest > 1).any():
            raise ValueError(
                f"the lobes reflect up to {largest.max():.3f} of the light, expected at most 1; "
                "lower their weight or color"
            )
        return largest

    @cached_property
    def lambert_albedo(self) -> np.ndarray:
        """Albedo (3,) of the Lambert term as used: of the hue of diffuse, within the limit."""
        diffuse = np.array(self.diffuse, dtype=np.float64)
        room = np.maximum(ALBEDO_LIMIT - self.lobe_albedo, 0)
        share = room / np.where(diffuse > 0, diffuse, 1)
        return diffuse * min(1.0, share[diffuse > 0].min(initial=1.0))

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Value (n, 3), 1/sr, for unit directions (n, 3); 0 where one is not above the horizon."""
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        angles = _pair_angles(wi[above], wo[above])
        value = np.zeros((above.size, 3))
        value[above] = self.lambert_albedo / np.pi + sum(lobe.f_r(angles) for lobe in self.lobes)
        return value


@dataclass(frozen=True)
class AnisotropicGgxLobe:
    """As GgxLobe, with a roughness along the tangent and one across it (Heitz 2014).

    alpha_x, alpha_y : roughness of the distribution, above 0 up to 1
    f0 : reflectance of a facet seen head-on, [0, 1] per channel
    rotation : of the tangent about the normal, degrees, counter-clockwise
    weight : factor of the whole lobe, at least 0
    """

    alpha_x: float
    alpha_y: float
    f0: Color
    rotation: float = 0.0
    weight: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        _check_alpha(self.alpha_x)
        _check_alpha(self.alpha_y)
        _check_color("f0", self.f0)

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Value (n, 3), 1/sr, for unit directions (n, 3) above the horizon."""
        angle = np.radians(self.rotation)
        cos, sin = np.cos(angle), np.sin(angle)
        to_tangent = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        wi, wo = wi @ to_tangent, wo @ to_tangent
        h = normalized(wi + wo)
        alphas = np.array([self.alpha_x, self.alpha_y, 1.0])
        ndf = 1 / (np.pi * self.alpha_x * self.alpha_y * ((h / alphas) ** 2).sum(1) ** 2)
        # G1(w) / (2 cos) = 1 / (cos + |(alpha_x x, alpha_y y, cos)|)
        masking = 1.0
        for w in (wi, wo):
            masking = masking / (w[:, 2] + np.linalg.norm(w * alphas, axis=1))
        f0 = np.array(self.f0)
        cos_d = np.clip((wi * h).sum(1), 0, 1)
        fresnel = f0 + (1 - f0) * ((1 - cos_d) ** 5)[:, None]
        return fresnel * (self.weight * ndf * masking)[:, None]


@dataclass(frozen=True)
class AnisotropicBrdf:
    """A Lambert term and lobes that depend on the tangent; reciprocal.

    diffuse : albedo of the Lambert term, [0, 1] per channel
    lobes : added to it
    """

    diffuse: Color
    lobes: tuple[AnisotropicGgxLobe, ...]

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        value = np.zeros((len(wi), 3))
        value[above] = np.array(self.diffuse) / np.pi
        value[above] += sum(lobe.f_r(wi[above], wo[above]) for lobe in self.lobes)
        return value


ANISOTROPIC_SAMPLES: dict[str, AnisotropicBrdf] = {
    "brushed-brass": AnisotropicBrdf(
        diffuse=(0.02, 0.015, 0.008), lobes=(AnisotropicGgxLobe(0.18, 0.5, (0.89, 0.75, 0.42)),)
    ),
    # two families of threads at right angles, each shining across itself
    "shot-silk": AnisotropicBrdf(
        diffuse=(0.10, 0.03, 0.14),
        lobes=(
            AnisotropicGgxLobe(0.2, 0.7, (0.40, 0.08, 0.10), weight=0.6),
            AnisotropicGgxLobe(0.24, 0.7, (0.06, 0.10, 0.45), rotation=90.0, weight=0.4),
        ),
    ),
}


SAMPLES: dict[str, AnalyticBrdf] = {
    "rough-plastic": AnalyticBrdf(
        diffuse=(0.05, 0.28, 0.32), lobes=(GgxLobe(alpha=0.3, f0=(0.045, 0.045, 0.045)),)
    ),
    "glossy-plastic": AnalyticBrdf(
        diffuse=(0.42, 0.03, 0.02), lobes=(GgxLobe(alpha=0.05, f0=(0.045, 0.045, 0.045)),)
    ),
    "brushed-copper": AnalyticBrdf(
        diffuse=(0.0, 0.0, 0.0), lobes=(GgxLobe(alpha=0.2, f0=(0.95, 0.64, 0.54)),)
    ),
    "copper-paint": AnalyticBrdf(
        diffuse=(0.06, 0.015, 0.006),
        lobes=(
            GgxLobe(alpha=0.04, f0=(0.04, 0.04, 0.04), weight=0.8),  # clear coat
            GgxLobe(alpha=0.32, f0=(0.85, 0.36, 0.16), weight=0.45),  # flakes
        ),
    ),
    "satin": AnalyticBrdf(
        diffuse=(0.10, 0.05, 0.20),
        lobes=(
            GgxLobe(alpha=0.38, f0=(0.30, 0.18, 0.48), weight=0.6),
            SheenLobe(alpha=0.5, color=(0.10, 0.08, 0.14)),
        ),
    ),
    "velvet": AnalyticBrdf(
        diffuse=(0.09, 0.006, 0.012), lobes=(SheenLobe(alpha=0.25, color=(0.5, 0.10, 0.14)),)
    ),
}


def tabulate(
    brdf: AnalyticBrdf, noise: float = 0.0, rng: np.random.Generator | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Tabulate a BRDF at the bin centres of the MERL grid.

    Parameters
    ----------
    brdf
        What to tabulate.
    noise
        Standard deviation of multiplicative lognormal noise, independent per bin and channel,
        that keeps the mean.
    rng
        Source of the noise.

    Returns
    -------
    f_r
        (90, 90, 180, 3), 1/sr; 0 where not valid.
    valid
        (90, 90, 180), the bins above the horizon.
    """
    if not (0 <= noise < np.inf):
        raise ValueError(f"noise {noise}, expected a finite number of at least 0")
    if noise > 0 and rng is None:
        raise ValueError("noise needs an rng, expected numpy.random.default_rng(seed)")
    theta_d = theta_d_centres()[:, None]
    phi_d = phi_d_centres()[None, :]
    shape = (N_THETA_D, N_PHI_D, 3)
    f_r = np.empty((N_THETA_H, *shape))
    for row, theta_h in zip(f_r, theta_h_centres(), strict=True):
        wi, wo = directions_from_rusinkiewicz(theta_h, theta_d, phi_d)
        row[...] = brdf.f_r(wi.reshape(-1, 3), wo.reshape(-1, 3)).reshape(shape)
        if noise > 0:
            row *= np.exp(noise * rng.standard_normal(shape) - noise**2 / 2)
    valid = merl_bins().above_horizon
    f_r[~valid] = 0
    return f_r, valid


def write_sample(
    path: str | os.PathLike,
    name: str,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> None:
    """Write one of SAMPLES as a MERL file, or of ANISOTROPIC_SAMPLES as a UTIA .bin file.

    noise : as in tabulate, for MERL files only
    """
    if name in ANISOTROPIC_SAMPLES:
        if noise:
            raise NfmError(f"{name!r}: anisotropic samples are written without noise; leave it 0")
        utia.write_bin(path, anisotropic_metrics.tabulate(ANISOTROPIC_SAMPLES[name]))
        return
    if name not in SAMPLES:
        names = ", ".join([*SAMPLES, *ANISOTROPIC_SAMPLES])
        raise NfmError(f"{name!r}: no such sample, there are {names}; choose one")
    merl.write(path, *tabulate(SAMPLES[name], noise, rng))


def _smith_over_2_cos(cos: np.ndarray, alpha2: float) -> np.ndarray:
    sin2 = np.maximum(1 - cos**2, 0)
    return 1 / (cos + np.sqrt(cos**2 + alpha2 * sin2))


def _quadrature() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Midpoints x in (0, 1), cubically denser at 0, and phi in (0, pi), with weights of sum 1.

    The integrands here change fast where x, their distance to the horizon, is small. The half of
    the circle left out mirrors the other.
    """
    midpoints = (np.arange(QUADRATURE) + 0.5) / QUADRATURE
    t, phi = np.meshgrid(midpoints, midpoints * np.pi, indexing="ij")
    weight = t**2 / np.sum(t**2)
    return (t**3).ravel(), phi.ravel(), weight.ravel()


def _spherical(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    sin = np.sin(theta)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)], axis=-1)
