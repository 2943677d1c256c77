# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps without size, which samplings made of mirrors alone do not see."""

from __future__ import annotations

import bpy

# Samplings whose closures are perfect mirrors: no light sampling reaches them, and no ray of theirs
# meets a point.
BLIND_SAMPLINGS = ("REFERENCE", "COSINE")


def lamps_without_size(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects of the scene whose lamp has radius, or angle, 0; in the order of their names."""
    lamps = [item for item in scene.objects if item.type == "LIGHT" and _size(item.data) == 0]
    return sorted(lamps, key=lambda item: item.name)


def give_size(lamp: bpy.types.Light, radius: float) -> None:
    """Radius in metres for point and spot lamps; a sun gets that many radians.

    An area lamp gets twice the radius for each of its sides that is 0.
    """
    if lamp.type == "SUN":
        lamp.angle = radius
    elif lamp.type == "AREA":
        for side in _sides(lamp):
            if getattr(lamp, side) == 0:
                setattr(lamp, side, 2 * radius)
    else:
        lamp.shadow_soft_size = radius


def _size(lamp: bpy.types.Light) -> float:
    if lamp.type == "SUN":
        return lamp.angle
    if lamp.type == "AREA":
        return min(getattr(lamp, side) for side in _sides(lamp))
    return lamp.shadow_soft_size


def _sides(lamp: bpy.types.Light) -> tuple[str, ...]:
    """Properties with the sides of an area lamp; squares and discs have only one."""
    return ("size", "size_y") if lamp.shape in ("RECTANGLE", "ELLIPSE") else ("size",)
