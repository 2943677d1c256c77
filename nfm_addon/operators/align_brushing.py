# SPDX-License-Identifier: GPL-3.0-or-later
"""Turn an anisotropic material so that its brush marks or threads follow the tangent."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.utils import register_classes_factory

from ..node_group import find_group_node
from .measured_material import EditOperator, active_material


class NFM_OT_align_brushing(EditOperator, bpy.types.Operator):
    """bpy.ops.nfm.align_brushing()."""

    bl_idname = "nfm.align_brushing"
    bl_label = "Align with Tangent"
    bl_description = (
        "Set Rotation so that the measured main direction, of brush marks or of the stronger "
        "threads, lies along the tangent"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not super().poll(context):
            return False
        if not active_material(context).nfm.anisotropy_strength:
            cls.poll_message_set("The material is the same in all directions")
            return False
        return True

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> str:
        socket = find_group_node(material).inputs["Rotation"]
        # what lies counter-clockwise of the tangent is turned back
        socket.default_value = -material.nfm.anisotropy_direction
        message = rpt_("Rotation is {:.1f} degrees")
        if socket.is_linked:
            message = rpt_("Rotation would be {:.1f} degrees, but something is linked to it")
        return message.format(socket.default_value)


register, unregister = register_classes_factory((NFM_OT_align_brushing,))
