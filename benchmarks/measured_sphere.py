# SPDX-License-Identifier: GPL-3.0-or-later
"""The sphere of fitter/pictures/sphere.py without tables, for materials sharper than a map's texel.

There a table is looked up once per texel of 128 x 64. A lobe much narrower than that falls between
the directions or on one of them, whatever the BRDF, and the picture is moire. Here the integral
over each texel is shared between its middle and directions drawn from the visible normals of the
measured file, weighted by the balance heuristic (Veach and Guibas 1995). The radiance is that of
the 128 x 64 texels. All BRDFs are integrated with the same directions, laid out on a regular grid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from fitter.formats.adaptive_brdf import AdaptiveBrdf
from fitter.pictures.sphere import LitScene, local_frame, texel_index

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]

# Directions drawn for each pixel: the square of this.
GRID = 48


def render(
    scene: LitScene, file: AdaptiveBrdf, brdfs: Sequence[Evaluate], grid: int = GRID
) -> np.ndarray:
    """Linear pixels (brdfs, environments, n_pixels, 3).

    brdfs : each takes unit wi, wo (n, 3) above the horizon to f_r (n, 3), 1/sr
    """
    out = np.zeros((len(brdfs), len(scene.light), len(scene.normals), 3))
    middle = (np.arange(grid) + 0.5) / grid
    x, y = (axis.ravel() for axis in np.meshgrid(middle, middle))
    for pixel, normal in enumerate(scene.normals):
        frame = local_frame(normal)
        wo = frame[:, 2]
        drawn = file.sample(np.broadcast_to(wo, (x.size, 3)), x, y)
        texels = np.concatenate([np.arange(len(scene.directions)), texel_index(drawn @ frame)])
        wi = np.concatenate([scene.directions @ frame.T, drawn])
        lit = wi[:, 2] > 0
        wi, texels = wi[lit], texels[lit]
        view = np.broadcast_to(wo, wi.shape)
        # directions per steradian of both sets together: each stands for the inverse
        density = 1 / scene.solid_angle[texels] + x.size * file.pdf(view, wi)
        share = wi[:, 2] / (density * scene.solid_angle[texels])
        for number, f_r in enumerate(brdfs):
            reflected = f_r(wi, view) * share[:, None]
            out[number, :, pixel] = np.einsum("edc,dc->ec", scene.light[:, texels], reflected)
    return out
