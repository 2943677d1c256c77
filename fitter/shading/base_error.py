# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the base lobes are from the model, as an artist would see it.

A sphere, seen from afar, under a light of our own: a sky that darkens towards the ground, a soft
box and a small bright lamp. The same directions serve the model and the base, so that their
difference holds no noise and no error of the quadrature that both share. Tangents of anisotropic
materials run in the direction of increasing longitude about the upward axis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..geometry import azimuth, normalized
from ..measurement import Measurement
from ..models.factors import Factors
from ..models.model import FactorModel
from ..pictures.sphere import rendered_psnr
from ..polar_grid import unit_vectors
from ..quadrature import ViewQuadrature, view_quadrature
from .base_lobes import BaseLobes

Light = Callable[[np.ndarray], np.ndarray]

# Rings of equal projected area, from the middle of the sphere to its edge; points on each.
N_RINGS = 16
N_AZIMUTHS = 8
POINTS = (96, 16)
TURNED_POINTS = (48, 48)  # of anisotropic materials, whose D is less sharp, over all azimuths

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


def base_error(model: Factors, base: BaseLobes, light: Light | None = None) -> BaseError:
    """Compare under `light`: unit directions (n, 3), y up, to radiance (n, 3)."""
    pictures: tuple[list, list] = ([], [])
    difference = total = 0.0
    for view, weighted_light in sphere_views(light or studio, model.kind):
        cos_i = view.wi[:, 2:]
        diffuse = model.diffuse * cos_i
        exact = model.lobe_values(view.wi, view.wo[None]).sum(0) * cos_i + diffuse
        approximate = base.value(view.wi, view.wo) + diffuse
        difference += (np.abs(approximate - exact).sum(1) * view.solid_angle).sum()
        total += (exact.sum(1) * view.solid_angle).sum()
        for points, values in zip(pictures, (approximate, exact), strict=True):
            points.append(np.einsum("anc,nc->ac", weighted_light, values))
    picture, reference = (np.concatenate(points)[None] for points in pictures)
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
    """The points of the picture, ring by ring; those of every other ring stand between.

    Tangents point to the viewer.
    """
    return [
        Ring(view_quadrature(theta, *POINTS), np.array([_viewer_frame(n) for n in normals]))
        for theta, normals in _ring_normals(n_rings, n_azimuths)
    ]


def sphere_points(n_rings: int = N_RINGS, n_azimuths: int = N_AZIMUTHS) -> list[Ring]:
    """The same points, each for itself: tangents point to increasing longitude."""
    points = []
    for theta, normals in _ring_normals(n_rings, n_azimuths):
        view = view_quadrature(theta, *TURNED_POINTS, turn=2 * np.pi)
        for frame in map(_longitude_frame, normals):
            points.append(Ring(view.turned(float(azimuth(frame[:, 2]))), frame[None]))
    return points


def _ring_normals(n_rings: int, n_azimuths: int) -> list[tuple[float, np.ndarray]]:
    """View angle and normals (azimuths, 3) of every ring."""
    rings = []
    for ring in range(n_rings):
        theta = float(np.arcsin(np.sqrt((ring + 0.5) / n_rings)))
        phi = (np.arange(n_azimuths) + ring % 2 / 2) / n_azimuths * 2 * np.pi
        rings.append((theta, unit_vectors(np.full(n_azimuths, theta), phi)))
    return rings


def _viewer_frame(normal: np.ndarray) -> np.ndarray:
    return _frame(normal, np.array([0, 0, 1.0]) - normal * normal[2])


def _longitude_frame(normal: np.ndarray) -> np.ndarray:
    return _frame(normal, np.cross([0, 1.0, 0], normal))


def _frame(normal: np.ndarray, along: np.ndarray) -> np.ndarray:
    tangent = normalized(along)
    return np.stack([tangent, np.cross(normal, tangent), normal])


@lru_cache(maxsize=4)
def sphere_views(
    light: Light,
    kind: str = "isotropic",
    n_rings: int = N_RINGS,
    n_azimuths: int = N_AZIMUTHS,
) -> list[tuple[ViewQuadrature, np.ndarray]]:
    """Directions, and light times solid angle (points, n, 3) at them for the points they serve.

    kind : of the model; an isotropic one has one entry for each ring
    """
    mirrored = kind == "isotropic"  # the quadrature holds half of the directions
    scene = []
    for ring in (sphere_rings if mirrored else sphere_points)(n_rings, n_azimuths):
        wi = ring.view.wi
        radiance = np.array([light(wi @ frame) for frame in ring.frames])
        if mirrored:
            radiance += [light(wi * [1, -1, 1] @ frame) for frame in ring.frames]
            radiance /= 2
        scene.append((ring.view, radiance * ring.view.solid_angle[:, None]))
    return scene
