# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard sphere (nfm_addon/standard_sphere.py) in Mitsuba 3, of a measured file as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np

# Mitsuba's map has its poles at +-y and looks along +z where Blender's has them at +-z and looks
# along +x: the axes are turned in a cycle.
WORLD_FROM_MAP = [[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]

CAMERA_WIDTH = 2.2


def render(
    bsdf: dict, environment: Path | None, resolution: int, samples: int, seed: int
) -> np.ndarray:
    """Linear pixels (resolution, resolution, 3), top row first; the environment is in them too.

    bsdf : for mitsuba.load_dict, such as {"type": "measured", "filename": "a_rgb.bsdf"}
    environment : map for the world; None is uniform white
    """
    import mitsuba

    # of the variants that measured RGB files load in, the one that needs no compiler
    mitsuba.set_variant("scalar_rgb")
    # negative channels, of colours out of gamut, would be a warning for every sample
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    transform = mitsuba.ScalarTransform4f
    camera = transform().look_at(origin=[0, -4, 0], target=[0, 0, 0], up=[0, 0, 1])
    light = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    if environment:
        light = {
            "type": "envmap",
            "filename": str(environment),
            "to_world": transform(WORLD_FROM_MAP),
        }
    scene = mitsuba.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "orthographic",
                "to_world": camera @ transform().scale([CAMERA_WIDTH / 2, CAMERA_WIDTH / 2, 1]),
                "sampler": {"type": "independent", "sample_count": samples},
                "film": {
                    "type": "hdrfilm",
                    "width": resolution,
                    "height": resolution,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                    "component_format": "float32",
                },
            },
            "light": light,
            "sphere": {"type": "sphere", "bsdf": bsdf},
        }
    )
    return np.array(mitsuba.render(scene, seed=seed), dtype=np.float64)[..., :3]
