# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic environment maps, under which a fit is made to look like its data.

Any light shows a material, so these resemble no place: a sky whose brightness varies over decades
and most at large scales, as that of photographed maps does (Dror et al. 2001), and lamps of all
sizes. They are drawn with a fixed seed. The maps of the benchmarks are not among them.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from .sphere import ENVIRONMENT_SHAPE, texel_directions

SEED = 1

# Blobs whose sum is the logarithm of the sky, and their widths, degrees.
N_CLOUDS = 40
CLOUD_WIDTHS = (8.0, 70.0)

# Lamps, their widths, degrees, and the share of all light that they give.
N_LAMPS = 12
LAMP_WIDTHS = (3.0, 30.0)
LAMP_SHARE = (0.3, 0.8)


@cache
def synthetic_maps(count: int) -> np.ndarray:
    """White radiance (count, 64, 128) with mean 1 over the texels, as sphere.py has maps.

    The maps of a smaller count are the first of a larger one.
    """
    rng = np.random.default_rng(SEED)
    directions = texel_directions()
    maps = []
    for _ in range(count):
        widths, clouds = _blobs(directions, N_CLOUDS, CLOUD_WIDTHS, rng)
        sky = np.exp(clouds @ (rng.normal(size=N_CLOUDS) * np.sqrt(widths / CLOUD_WIDTHS[1])))
        widths, lamps = _blobs(directions, N_LAMPS, LAMP_WIDTHS, rng)
        # the power of a lamp does not depend on its size
        lamplight = lamps @ (rng.exponential(size=N_LAMPS) / widths**2)
        share = rng.uniform(*LAMP_SHARE)
        maps.append((1 - share) * sky / sky.mean() + share * lamplight / lamplight.mean())
    stacked = np.array(maps).reshape(count, *ENVIRONMENT_SHAPE)
    stacked.flags.writeable = False
    return stacked


def _blobs(
    directions: np.ndarray, count: int, widths: tuple[float, float], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Widths (count,), degrees, and that many von Mises-Fisher lobes with maximum 1 (n, count)."""
    width = np.exp(rng.uniform(*np.log(widths), count))
    centre = rng.normal(size=(count, 3))
    centre /= np.linalg.norm(centre, axis=1, keepdims=True)
    return width, np.exp((directions @ centre.T - 1) / np.radians(width) ** 2)
