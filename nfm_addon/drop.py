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


def target(context: bpy.types.Context, event: bpy.types.Event) -> bpy.types.Object | None:
    """The object that a drop is meant for, or None for the selected ones.

    In the 3D viewport the one that is seen below the mouse, in a shader editor the one whose
    material is shown.
    """
    area = context.area
    if area is None:
        return None
    if area.type == "VIEW_3D":
        return object_under_mouse(context, event)
    owner = area.spaces.active.id_from
    return owner if isinstance(owner, bpy.types.Object) else context.active_object


def object_under_mouse(
    context: bpy.types.Context, event: bpy.types.Event
) -> bpy.types.Object | None:
    """The object that is seen below the mouse in a 3D viewport; drops come with its region."""
    region, view = context.region, context.region_data
    if region is None or view is None:  # on a header, or a sidebar
        return None
    at = (event.mouse_x - region.x, event.mouse_y - region.y)
    origin = view3d_utils.region_2d_to_origin_3d(region, view, at)
    direction = view3d_utils.region_2d_to_vector_3d(region, view, at)
    hit, *_, found, _matrix = context.scene.ray_cast(
        context.evaluated_depsgraph_get(), origin, direction
    )
    return found.original if hit else None
