# SPDX-License-Identifier: GPL-3.0-or-later
"""The main direction of an anisotropic material: along the brush marks or the stronger threads.

Facets lie along the marks, so half vectors spread across them. Light that returns to where it came
from shows D itself, f_r(h, h), in any gauge: the azimuth at which it is strongest is across the
main direction. A sample can then be turned so that its marks follow the tangent. Cloth has a peak
for every family of threads, and the stronger one is taken; second moments would not see two
families at right angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import polar_grid
from .anisotropic_model import AnisotropicModel

# Harmonics of the profile over half a turn that are kept: the peak is found between the nodes, and
# noise does not move it.
HARMONICS = 3
LOOKED_AT = slice(1, 4)  # rows of the grid, 15 to 45 degrees; the pole has no azimuth
SEARCH_STEP = 0.1  # degrees


@dataclass(frozen=True)
class Anisotropy:
    """Main direction and strength.

    direction : degrees from the tangent, counter-clockwise, in [-90, 90)
    strength : (largest - smallest) / (largest + smallest) of the profile; near 0 the direction
        means nothing
    """

    direction: float
    strength: float


def anisotropy(model: AnisotropicModel) -> Anisotropy:
    """Anisotropy of the specular part of a model."""
    w = polar_grid.directions()
    specular = model.lobe_values(w, w).sum(0).mean(-1)
    light = specular * w[:, 2] ** 2 * polar_grid.solid_angles()
    profile = light.reshape(polar_grid.GRID)[LOOKED_AT].sum(0)
    half_turn = profile.reshape(2, -1).sum(0)
    spectrum = np.fft.rfft(half_turn)[: HARMONICS + 1] / len(half_turn)
    azimuth = np.radians(np.arange(0, 180, SEARCH_STEP))
    waves = np.exp(2j * np.outer(np.arange(1, HARMONICS + 1), azimuth))
    smooth = spectrum[0].real + 2 * (spectrum[1:] @ waves).real
    low, high = smooth.min(), smooth.max()
    across = np.degrees(azimuth[smooth.argmax()])
    return Anisotropy(
        direction=float(across % 180 - 90),
        strength=float((high - low) / (high + low)) if high > 0 else 0.0,
    )
