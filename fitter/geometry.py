# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions, the half-angle coordinates of Rusinkiewicz (1998) and the grid of the MERL database.

Conventions, everywhere in the project:

- the local frame has the normal as +z; wi points to the light, wo to the viewer, both unit;
- h = (wi + wo) / |wi + wo|; theta_h is its polar angle; theta_d is the angle between h and wi;
  phi_d is the azimuth of wi around h, 0 where wi lies in the plane of n and h on the side away
  from n (the direction of increasing theta_h);
- angles are radians.

An isotropic, reciprocal BRDF depends on theta_h in [0, pi/2], theta_d in [0, pi/2] and phi_d in
[0, pi): swapping wi and wo adds pi to phi_d, and mirroring at the plane of n and h negates it.

The MERL grid (Matusik et al. 2003) has 90 x 90 x 180 bins: theta_h on a square-root axis, which
spends its resolution at the peak, theta_d and phi_d uniform. Bin i covers [i, i + 1) of the index
axis and stands for its centre i + 1/2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

N_THETA_H = 90
N_THETA_D = 90
N_PHI_D = 180
HALF_PI = np.pi / 2


def theta_h_from_index(index: np.ndarray) -> np.ndarray:
    """Angle of a position on the square-root axis: (index / 90)^2 * pi/2."""
    return (np.asarray(index, dtype=np.float64) / N_THETA_H) ** 2 * HALF_PI


def index_from_theta_h(theta_h: np.ndarray) -> np.ndarray:
    """Inverse of theta_h_from_index; a bin's centre gives i + 1/2."""
    return np.sqrt(np.asarray(theta_h, dtype=np.float64) / HALF_PI) * N_THETA_H


def versine(theta: np.ndarray) -> np.ndarray:
    """1 - cos(theta) without cancellation."""
    return 2 * np.sin(np.asarray(theta) / 2) ** 2


def theta_h_centres() -> np.ndarray:
    """Bin centres (90,), radians."""
    return theta_h_from_index(np.arange(N_THETA_H) + 0.5)


def theta_d_centres() -> np.ndarray:
    """Bin centres (90,), radians."""
    return (np.arange(N_THETA_D) + 0.5) / N_THETA_D * HALF_PI


def phi_d_centres() -> np.ndarray:
    """Bin centres (180,), radians."""
    return (np.arange(N_PHI_D) + 0.5) / N_PHI_D * np.pi


def normalized(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors along the last axis; zero vectors stay zero."""
    vectors = np.asarray(vectors, dtype=np.float64)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def polar_angle(vectors: np.ndarray) -> np.ndarray:
    """Angle to +z of unit vectors (..., 3), precise at both ends (arccos loses digits at 0)."""
    x, y, z = _components(vectors)
    return np.arctan2(np.hypot(x, y), z)


def azimuth(vectors: np.ndarray) -> np.ndarray:
    """Angle of vectors (..., 3) of any length about +z, from +x towards +y; in [-pi, pi]."""
    x, y, _ = _components(vectors)
    return np.arctan2(y, x)


def half_angles(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """theta_h and theta_d of unit directions (..., 3); symmetric in wi and wo to the last bit."""
    total = wi + wo
    x, y, z = _components(total)
    theta_h = np.arctan2(np.hypot(x, y), z)
    # |wi + wo| = 2 cos theta_d, |wi - wo| = 2 sin theta_d
    theta_d = np.arctan2(np.linalg.norm(wi - wo, axis=-1), np.linalg.norm(total, axis=-1))
    return theta_h, theta_d


def _components(vectors: np.ndarray) -> np.ndarray:
    """x, y and z of vectors (..., 3), each contiguous.

    numpy 1.26 takes a vector or a scalar arctan2, which differ in the last bit, depending on where
    a strided operand happens to lie in memory; the same file would not always give the same fit.
    """
    return np.ascontiguousarray(np.moveaxis(vectors, -1, 0))


def rusinkiewicz_from_directions(
    wi: np.ndarray, wo: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """theta_h, theta_d and phi_d (folded to [0, pi)) of unit directions (..., 3)."""
    theta_h, theta_d = half_angles(wi, wo)
    h = normalized(wi + wo)
    sin_h = np.hypot(h[..., 0], h[..., 1])
    safe = np.where(sin_h > 1e-12, sin_h, 1)
    cos_phi = np.where(sin_h > 1e-12, h[..., 0] / safe, 1)
    sin_phi = np.where(sin_h > 1e-12, h[..., 1] / safe, 0)
    x = wi[..., 0] * cos_phi + wi[..., 1] * sin_phi
    y = -wi[..., 0] * sin_phi + wi[..., 1] * cos_phi
    along = x * h[..., 2] - wi[..., 2] * sin_h
    phi_d = np.mod(np.arctan2(y, along), np.pi)
    return theta_h, theta_d, np.where(phi_d >= np.pi, 0.0, phi_d)


def directions_from_rusinkiewicz(
    theta_h: np.ndarray, theta_d: np.ndarray, phi_d: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Unit wi and wo (..., 3), h in the x-z plane; either may lie below the horizon."""
    theta_h, theta_d, phi_d = np.broadcast_arrays(theta_h, theta_d, phi_d)
    sin_d = np.sin(theta_d)
    dx, dy, dz = sin_d * np.cos(phi_d), sin_d * np.sin(phi_d), np.cos(theta_d)
    sin_h, cos_h = np.sin(theta_h), np.cos(theta_h)
    wi = np.stack([dx * cos_h + dz * sin_h, dy, dz * cos_h - dx * sin_h], -1)
    wo = np.stack([dz * sin_h - dx * cos_h, -dy, dz * cos_h + dx * sin_h], -1)
    return wi, wo


@dataclass(frozen=True)
class MerlBins:
    """Geometry of the bin centres of the MERL grid; arrays (90, 90, 180)."""

    cos_i: np.ndarray
    cos_o: np.ndarray

    @cached_property
    def above_horizon(self) -> np.ndarray:
        """Mask of the bins whose both directions are in the upper hemisphere."""
        return (self.cos_i > 0) & (self.cos_o > 0)


@cache
def merl_bins() -> MerlBins:
    """Cosines at the bin centres: cos theta_{i,o} = cos th cos td -+ sin th sin td cos pd."""
    theta_h = theta_h_centres()[:, None, None]
    theta_d = theta_d_centres()[None, :, None]
    phi_d = phi_d_centres()[None, None, :]
    mean = np.cos(theta_h) * np.cos(theta_d)
    difference = np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    bins = MerlBins(cos_i=mean - difference, cos_o=mean + difference)
    for cosine in (bins.cos_i, bins.cos_o):
        cosine.flags.writeable = False
    return bins


def merl_solid_angle() -> np.ndarray:
    """Relative measure (90, 90) of a (theta_h, theta_d) cell, the same for all phi_d; sums to 1.

    The measure of a pair of directions in half-angle coordinates is proportional to
    sin theta_h dtheta_h cos theta_d sin theta_d dtheta_d dphi_d; it is integrated exactly.
    """
    theta_h = theta_h_from_index(np.arange(N_THETA_H + 1))
    theta_d = np.linspace(0, HALF_PI, N_THETA_D + 1)
    return np.outer(np.diff(versine(theta_h)), np.diff(np.sin(theta_d) ** 2))


def merl_bin_index(wi: np.ndarray, wo: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bin (theta_h, theta_d, phi_d) that holds each pair of unit directions (..., 3)."""
    theta_h, theta_d, phi_d = rusinkiewicz_from_directions(wi, wo)
    return (
        np.clip(index_from_theta_h(theta_h).astype(np.intp), 0, N_THETA_H - 1),
        np.clip((theta_d / HALF_PI * N_THETA_D).astype(np.intp), 0, N_THETA_D - 1),
        np.clip((phi_d / np.pi * N_PHI_D).astype(np.intp), 0, N_PHI_D - 1),
    )
