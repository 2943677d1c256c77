# SPDX-License-Identifier: GPL-3.0-or-later
"""Set a material back to what was measured."""

from __future__ import annotations

import bpy
from bpy.utils import register_classes_factory

from .. import material as materials
from ..context import NeedsMaterial, measured_material
from ..node_group import LOBE_SOCKETS


class NFM_OT_reset_material(NeedsMaterial, bpy.types.Operator):
    """bpy.ops.nfm.reset_material()."""

    bl_idname = "nfm.reset_material"
    bl_label = "Reset"
    bl_description = "Set diffuse colour and lobe scales back to what was measured; show all lobes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        item = measured_material(context)
        node = materials.find_group_node(item)
        defaults = node.node_tree.interface.items_tree
        for name in ("Diffuse", *LOBE_SOCKETS):
            node.inputs[name].default_value = defaults[name].default_value
        item.nfm.mute = item.nfm.solo = (False,) * 3
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_reset_material,))
