# SPDX-License-Identifier: GPL-3.0-or-later
"""A studio of soft boxes as an environment map, for the demo: made by us, so it can be shipped."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT = 512, 256

# azimuth, elevation (degrees; azimuth 0 is behind the camera), half width, half height, radiance
SOFT_BOXES = (
    (-55, 35, 22, 18, (16.0, 14.5, 13.0)),
    (60, 15, 8, 32, (5.0, 6.0, 8.0)),
    (165, 50, 30, 10, (9.0, 9.0, 9.0)),
    (-140, 5, 6, 40, (7.0, 5.5, 4.0)),
)


def studio() -> np.ndarray:
    """Radiance (256, 512, 3), top row first, in Blender's equirectangular orientation."""
    # Blender: the image's centre column is direction -Y... +Y lies at the seam; see the camera,
    # which stands at -Y and sees the light from behind it reflected in the middle of the sphere
    azimuth = (np.arange(WIDTH) + 0.5) / WIDTH * 360 - 180
    elevation = 90 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 180
    azimuth, elevation = np.meshgrid(azimuth, elevation)
    height = (elevation[..., None] + 90) / 180
    radiance = 0.06 + 0.25 * height**2 * np.array([0.8, 0.9, 1.0])
    for centre, middle, half_width, half_height, color in SOFT_BOXES:
        across = np.abs((azimuth - centre + 180) % 360 - 180) * np.cos(np.radians(middle))
        along = np.abs(elevation - middle)
        inside = _soft_step(half_width - across) * _soft_step(half_height - along)
        radiance = radiance + inside[..., None] * np.array(color)
    return radiance


def _soft_step(distance: np.ndarray) -> np.ndarray:
    """0 to 1 over two degrees around 0."""
    t = np.clip(distance / 2 + 0.5, 0, 1)
    return t * t * (3 - 2 * t)
