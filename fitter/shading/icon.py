# SPDX-License-Identifier: GPL-3.0-or-later
"""A small picture of a material for lists and asset browsers: a sphere under soft boxes.

f at one view angle serves a whole ring of the sphere, so an anisotropic material is shown as its
mean over azimuths; the picture is interpolated between rings.
"""

from __future__ import annotations

import numpy as np

from ..models.factors import Factors
from ..pictures.sphere import DISPLAY_GAMMA
from .base_error import disc, sphere_views
from .stand_in import without_direction

SIZE = 128
RINGS, AZIMUTHS = 24, 48

EXPOSURE = 1.5


def material_icon(model: Factors, size: int = SIZE) -> np.ndarray:
    """Display values 0..1, RGBA (size, size, 4) float32, bottom row first; alpha 0 around it."""
    model = without_direction(model)
    rings = np.empty((RINGS, AZIMUTHS, 3))
    scene = sphere_views(soft_boxes, model.kind, RINGS, AZIMUTHS)
    for ring, (view, weighted_light) in enumerate(scene):
        wo = np.broadcast_to(view.wo, view.wi.shape)
        f_cos = model.f_r(view.wi, wo) * view.wi[:, 2:]
        rings[ring] = np.einsum("anc,nc->ac", weighted_light, f_cos)
    axis = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(axis, axis)
    squared = (x * x + y * y) * 1.03
    icon = np.ones((size, size, 4), np.float32)
    icon[..., :3] = np.clip(_interpolated(rings, squared, np.arctan2(y, x)) * EXPOSURE, 0, 1) ** (
        1 / DISPLAY_GAMMA
    )
    # a soft edge, one pixel wide
    icon[..., 3] = np.clip((1 - np.sqrt(squared)) * size / 2 + 0.5, 0, 1)
    return icon


def soft_boxes(directions: np.ndarray) -> np.ndarray:
    """Radiance (..., 3): a sky and two boxes with edges so soft that the quadrature sees none."""
    sky = np.clip(0.3 + 0.4 * directions[..., 1:2], 0.1, None) * np.array([0.9, 1.0, 1.1])
    key = disc(directions, (-0.6, 0.5, 0.6), degrees=24, softness=14)
    rim = disc(directions, (0.8, 0.3, 0.4), degrees=12, softness=9)
    return sky + 5 * key * np.array([1.0, 0.95, 0.9]) + 3 * rim * np.array([0.9, 0.95, 1.0])


def _interpolated(rings: np.ndarray, squared: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Values (h, w, 3) at squared radii and azimuths (h, w) of what stands on rings."""
    # the middle, where the azimuth means nothing, is a ring of one colour
    middle = np.broadcast_to(rings[:1].mean(1, keepdims=True), rings[:1].shape)
    rings = np.concatenate([middle, rings])
    position = np.clip(squared * RINGS + 0.5, 0, RINGS)
    inner = np.minimum(position.astype(int), RINGS - 1)
    share = (position - inner)[..., None]
    return (
        _on_ring(rings, inner, azimuth) * (1 - share) + _on_ring(rings, inner + 1, azimuth) * share
    )


def _on_ring(rings: np.ndarray, ring: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    # ring 0 is the middle; of the others every second is turned by half a step, from the second on
    step = azimuth / (2 * np.pi) * AZIMUTHS - (ring + 1) % 2 / 2
    before = np.floor(step).astype(int)
    share = (step - before)[..., None]
    here, after = rings[ring, before % AZIMUTHS], rings[ring, (before + 1) % AZIMUTHS]
    return here * (1 - share) + after * share
