# SPDX-License-Identifier: GPL-3.0-or-later
"""Drag and drop: where files may be dropped, and which object is below the mouse."""

from __future__ import annotations

import bpy
from bpy_extras import view3d_utils


def takes_drops(context: bpy.types.Context) -> bool:
    """Whether the area below the mouse shows objects or a material."""
    area = context.area
    if area is None:
        return False
    if area.type == "VIEW_3D":
        return True
    return area.type == "NODE_EDITOR" and area.spaces.active.tree_type == "ShaderNodeTree"


def object_under_mouse(
    context: bpy.types.Context, event: bpy.types.Event
) -> bpy.types.Object | None:
    """The object that is seen below the mouse in the 3D viewport."""
    area = context.area
    if area is None or area.type != "VIEW_3D":
        return None
    region = next(region for region in area.regions if region.type == "WINDOW")
    view = area.spaces.active.region_3d
    at = (event.mouse_x - region.x, event.mouse_y - region.y)
    origin = view3d_utils.region_2d_to_origin_3d(region, view, at)
    direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
    hit, *_, found, _matrix = context.scene.ray_cast(
        context.evaluated_depsgraph_get(), origin, direction
    )
    return found.original if hit else None
