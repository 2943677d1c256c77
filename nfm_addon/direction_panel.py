# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines of the panel about the direction of an anisotropic material."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .node_group import find_group_node
from .operators.align_brushing import NFM_OT_align_brushing
from .panel_text import fact

# Below this strength the main direction means nothing.
LEAST_STRENGTH = 0.05


def draw_direction(layout: bpy.types.UILayout, item: bpy.types.Material) -> None:
    """Draw the measured direction, the Rotation and the button that brings them together."""
    rotation = find_group_node(item).inputs.get("Rotation")
    if rotation is None:
        return
    column = layout.column(align=True)
    settings = item.nfm
    text = iface_("None")
    if settings.anisotropy_strength >= LEAST_STRENGTH:
        text = iface_("{:.1f}\N{DEGREE SIGN} from the tangent").format(
            settings.anisotropy_direction
        )
    fact(column, "Main Direction", text)
    column.prop(rotation, "default_value", text="Rotation")
    column.operator(NFM_OT_align_brushing.bl_idname)
