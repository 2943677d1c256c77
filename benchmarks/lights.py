# SPDX-License-Identifier: GPL-3.0-or-later
"""The five lights of ./nfm bench render, as Blender has them (expected.py: the same in numpy).

Lamps of 200 W stand at (2, -3, 2), 4.1 m from the middle of the sphere.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from . import shared_data

LAMP_POSITION = (2.0, -3.0, 2.0)
LAMP_WATTS = 200.0


@dataclass(frozen=True)
class Light:
    """A light of the benchmark.

    environment : map of the world; None is a black world with one lamp
    lamp : "point" or "area"
    size : radius of a point lamp, side of an area lamp, m
    """

    name: str
    title: str
    environment: Path | None = None
    lamp: str = ""
    size: float = 0.0


LIGHTS = {
    light.name: light
    for light in (
        Light("studio", "studio map", environment=shared_data.STUDIO),
        Light("sun", "map with a sun", environment=shared_data.GARDEN),
        Light("lamp", "0.1 m point lamp", lamp="point", size=0.1),
        Light("area", "1 m area lamp", lamp="area", size=1.0),
        Light("zero", "zero-radius lamp", lamp="point", size=0.0),
    )
}


def add_lamp(scene: object, light: Light) -> None:
    """Add the lamp of a light to a scene; the area lamp looks at the origin."""
    import bpy
    from mathutils import Vector

    data = bpy.data.lights.new(light.name, light.lamp.upper())
    data.energy = LAMP_WATTS
    if light.lamp == "area":
        data.shape, data.size = "SQUARE", light.size
    else:
        data.shadow_soft_size = light.size
        data.use_soft_falloff = False  # the lamp is a sphere of even radiance, nothing else
    lamp = bpy.data.objects.new(light.name, data)
    lamp.location = LAMP_POSITION
    lamp.rotation_euler = (-Vector(LAMP_POSITION)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(lamp)
