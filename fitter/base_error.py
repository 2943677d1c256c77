# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the base lobes are from the model, as an artist would see it.

A sphere, seen from afar, under a light of our own: a sky that darkens towards the ground, a soft
box and a small bright lamp. The same directions serve the model and the base, so that their
difference holds no noise and no error of the quadrature that both share.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .base_lobes import BaseLobes
from .geometry import normalized
from .measurement import Measurement
from .model import FactorModel
from .quadrature import ViewQuadrature, view_quadrature
from .sphere import rendered_psnr

Light = Callable[[np.ndarray], np.ndarray]

# Rings of equal projected area, from the middle of the sphere to its edge; points on each.
N_RINGS = 16
N_AZIMUTHS = 8
POINTS = (96, 16)

LARGEST_PSNR = 200.0  # dB, stands for no error at all


@dataclass(frozen=True)
class BaseError:
    """Error of the base against the model.

    directional : mean |base - f cos| over mean f cos, over all directions and the view angles of a
        sphere's projected area, mean of the channels
    image : the same of a picture's pixels, sum |difference| over sum
    psnr : of that picture, dB, the protocol of sphere.py
    """

    directional: float
    image: float
    psnr: float

    def figures(self) -> dict[str, float]:
        """The figures by the names that reports and materials have for them, all finite."""
        return {
            "native_error": self.image,
            "native_directional_error": self.directional,
            "native_psnr": min(self.psnr, LARGEST_PSNR),
        }


def base_error(model: FactorModel, base: BaseLobes, light: Light | None = None) -> BaseError:
    """Compare under `light`: unit directions (n, 3), y up, to radiance (n, 3)."""
    pictures = np.empty((2, N_RINGS, N_AZIMUTHS, 3))
    difference = total = 0.0
    for ring, (view, weighted_light) in enumerate(sphere_views(light or studio)):
        wo = np.broadcast_to(view.wo, view.wi.shape)
        cos_i = view.wi[:, 2:]
        diffuse = model.diffuse * cos_i
        exact = model.lobe_values(view.wi, wo).sum(0) * cos_i + diffuse
        approximate = base.value(view.wi, view.wo) + diffuse
        difference += (np.abs(approximate - exact).sum(1) * view.solid_angle).sum()
        total += (exact.sum(1) * view.solid_angle).sum()
        for row, values in zip(pictures, (approximate, exact), strict=True):
            row[ring] = np.einsum("anc,nc->ac", weighted_light, values)
    picture, reference = (p.reshape(1, -1, 3) for p in pictures)
    if not total > 0:
        return BaseError(0.0, 0.0, float("inf"))
    return BaseError(
        directional=float(difference / total),
        image=float(np.abs(picture - reference).sum() / reference.sum()),
        psnr=float(rendered_psnr(picture, reference)[0]),
    )


def studio_psnr(model: FactorModel, measurement: Measurement) -> float:
    """PSNR in dB, at most LARGEST_PSNR, of the same picture of a model against that of the data.

    Bins without a measurement are left out of both.
    """
    pictures = np.empty((2, 1, N_RINGS, N_AZIMUTHS, 3))
    for ring, (view, weighted_light) in enumerate(sphere_views(studio)):
        wo = np.broadcast_to(view.wo, view.wi.shape)
        cos_i = view.wi[:, 2:]
        known = measurement.lookup_valid(view.wi, wo)[:, None]
        for picture, f_r in zip(
            pictures,
            (model.f_r(view.wi, wo) * known, measurement.lookup(view.wi, wo)),
            strict=True,
        ):
            picture[0, ring] = np.einsum("anc,nc->ac", weighted_light, f_r * cos_i)
    fitted, measured = pictures.reshape(2, 1, -1, 3)
    return min(float(rendered_psnr(fitted, measured)[0]), LARGEST_PSNR)


def studio(directions: np.ndarray) -> np.ndarray:
    """Radiance (..., 3) of the built-in light."""
    up = directions[..., 1:2]
    sky = np.where(up > 0, 0.25 + 0.35 * up, 0.12) * np.array([0.9, 1.0, 1.1])
    box = disc(directions, (-0.6, 0.5, 0.6), degrees=22, softness=4)
    lamp = disc(directions, (0.5, 0.6, 0.7), degrees=4, softness=1)
    return sky + 5 * box * np.array([1.0, 0.95, 0.9]) + 80 * lamp * np.array([1.0, 0.9, 0.75])


def disc(
    directions: np.ndarray, towards: tuple[float, float, float], degrees: float, softness: float
) -> np.ndarray:
    """1 within a disc of a light, 0 outside, falling over twice the softness: (..., 1)."""
    angle = np.degrees(np.arccos(np.clip(directions @ normalized(np.array(towards)), -1, 1)))
    return np.clip((degrees + softness - angle) / (2 * softness), 0, 1)[..., None]


@dataclass(frozen=True)
class Ring:
    """Points of the sphere that are seen at the same angle.

    view : directions in the frame of each point, which serve them all
    frames : (azimuths, 3, 3) rows tangent, bitangent and normal; the sphere is seen along -z
    """

    view: ViewQuadrature
    frames: np.ndarray


def sphere_rings(n_rings: int = N_RINGS, n_azimuths: int = N_AZIMUTHS) -> list[Ring]:
    """The points of the picture, ring by ring; those of every other ring stand between."""
    rings = []
    for ring in range(n_rings):
        theta = float(np.arcsin(np.sqrt((ring + 0.5) / n_rings)))
        azimuths = (np.arange(n_azimuths) + ring % 2 / 2) / n_azimuths * 2 * np.pi
        frames = np.array([_frame(theta, azimuth) for azimuth in azimuths])
        rings.append(Ring(view_quadrature(theta, *POINTS), frames))
    return rings


def _frame(theta: float, azimuth: float) -> np.ndarray:
    normal = np.array(
        [np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)]
    )
    tangent = normalized(np.array([0, 0, 1.0]) - normal * np.cos(theta))
    return np.stack([tangent, np.cross(normal, tangent), normal])


@lru_cache(maxsize=2)
def sphere_views(
    light: Light, n_rings: int = N_RINGS, n_azimuths: int = N_AZIMUTHS
) -> list[tuple[ViewQuadrature, np.ndarray]]:
    """For every ring its directions, and light times solid angle (azimuths, n, 3) at them."""
    scene = []
    for ring in sphere_rings(n_rings, n_azimuths):
        # the quadrature holds half of the directions
        mirrored = ring.view.wi * [1, -1, 1]
        radiance = [(light(ring.view.wi @ f) + light(mirrored @ f)) / 2 for f in ring.frames]
        scene.append((ring.view, np.array(radiance) * ring.view.solid_angle[:, None]))
    return scene
