# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact pictures of anisotropic materials, as `sphere` makes them of isotropic ones.

Every pixel has a frame instead of a normal, and the material is a function of directions instead of
a table: the same texels of the same map, summed exactly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..geometry import normalized
from .sphere import RESOLUTION, Scene, sphere_normals

# f_r (n, 3) in 1/sr at unit wi, wo (n, 3) in the local frame: x = tangent, z = normal.
Brdf = Callable[[np.ndarray, np.ndarray], np.ndarray]

# Bounds the memory of a render: some 100,000 pairs of directions at a time.
PIXELS_AT_ONCE = 16

UP = np.array([0.0, 1.0, 0.0])
VIEW = np.array([0.0, 0.0, 1.0])


class FramedScene(Scene):
    """Visible points with tangent frames.

    normals, tangents : (n, 3) unit, one for each pixel that is True in `mask`; the tangents are
        made perpendicular to the normals
    mask, environments : as for sphere.LitScene
    """

    def __init__(
        self,
        normals: np.ndarray,
        tangents: np.ndarray,
        mask: np.ndarray,
        environments: list[np.ndarray],
    ) -> None:
        super().__init__(mask, environments)
        along = (tangents * normals).sum(1, keepdims=True)
        tangents = normalized(tangents - along * normals)
        self.frames = np.stack([tangents, np.cross(normals, tangents), normals], 1)

    def render(self, f_r: Brdf) -> np.ndarray:
        """Linear pixels (environments, n_pixels, 3)."""
        out = np.empty((len(self.light), len(self.frames), 3))
        for start in range(0, len(self.frames), PIXELS_AT_ONCE):
            frames = self.frames[start : start + PIXELS_AT_ONCE]
            wi = np.einsum("pij,kj->pki", frames, self.directions)
            pixel, texel = np.nonzero(wi[..., 2] > 0)
            wo = (frames @ VIEW)[pixel]
            wi = wi[pixel, texel]
            reflected = f_r(wi, wo) * wi[:, 2:]
            # pixels are in order, so each one's pairs stand together
            first = np.searchsorted(pixel, np.arange(len(frames)))
            for environment, light in enumerate(self.light):
                rows = slice(start, start + len(frames))
                out[environment, rows] = np.add.reduceat(reflected * light[texel], first)
        return out


def sphere_scene(environments: list[np.ndarray], resolution: int = RESOLUTION) -> FramedScene:
    """The unit sphere; tangents in the direction of increasing longitude about the upward axis."""
    normals, mask = sphere_normals(resolution)
    return FramedScene(normals, np.cross(UP, normals), mask, environments)


def cloth_scene(environments: list[np.ndarray], resolution: int = RESOLUTION) -> FramedScene:
    """A hanging cloth that fills the square from -1 to 1: a height field over x and y.

    Folds that open and turn downwards, with slopes up to 65 degrees. The warp, the tangent, runs
    along the height field in the direction of x.
    """
    axis = (np.arange(resolution) + 0.5) / resolution * 2 - 1
    x, y = (a.ravel() for a in np.meshgrid(axis, -axis))
    slope_x, slope_y = cloth_slopes(x, y)
    flat, one = np.zeros_like(x), np.ones_like(x)
    normals = normalized(np.stack([-slope_x, -slope_y, one], -1))
    tangents = np.stack([one, flat, slope_x], -1)
    return FramedScene(normals, tangents, np.ones((resolution, resolution), bool), environments)


def cloth_slopes(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slopes dz/dx and dz/dy (n,) of the cloth's height a(y) sin(p(x, y))."""
    amplitude, amplitude_y = 0.2 - 0.08 * y, -0.08  # folds are deeper further down
    phase = 9 * x + 1.5 * np.sin(2 * y) + 2 * x * y
    phase_x, phase_y = 9 + 2 * y, 3 * np.cos(2 * y) + 2 * x
    return (
        amplitude * phase_x * np.cos(phase),
        amplitude_y * np.sin(phase) + amplitude * phase_y * np.cos(phase),
    )
