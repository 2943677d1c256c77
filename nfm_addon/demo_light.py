# SPDX-License-Identifier: GPL-3.0-or-later
"""A studio of soft boxes as an environment map, for the demo: made by us, so it can be shipped."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT = 512, 256

# In Blender's default orientation the column at three quarters of the width lies along -Y, where
# the camera of the standard sphere stands.
CAMERA_COLUMN = 0.75

# Azimuth from the camera towards its right, elevation, half width, half height in degrees;
# radiance. Two boxes face the sphere, one is behind it for the rim, one lights from above.
SOFT_BOXES = (
    (-48, 38, 20, 16, (14.0, 13.0, 12.0)),
    (58, 8, 7, 34, (4.0, 5.0, 7.0)),
    (150, 25, 14, 30, (5.0, 5.0, 5.0)),
    (20, 78, 40, 8, (3.0, 3.0, 3.2)),
)


def studio() -> np.ndarray:
    """Radiance (256, 512, 3), top row first, in Blender's equirectangular orientation."""
    column = (np.arange(WIDTH) + 0.5) / WIDTH
    azimuth, elevation = np.meshgrid(
        (CAMERA_COLUMN - column) * 360, 90 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 180
    )
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
