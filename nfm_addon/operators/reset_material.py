# SPDX-License-Identifier: GPL-3.0-or-later
"""Set a material back to what was measured."""

from __future__ import annotations

import bpy
from bpy.utils import register_classes_factory

from ..node_group import LOBE_SOCKETS, find_group_node
from .measured_material import EditOperator


class NFM_OT_reset_material(EditOperator, bpy.types.Operator):
    """bpy.ops.nfm.reset_material()."""

    bl_idname = "nfm.reset_material"
    bl_label = "Reset"
    bl_description = "Set diffuse colour and lobe scales back to what was measured; show all lobes"

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> None:
        node = find_group_node(material)
        defaults = node.node_tree.interface.items_tree
        for name in ("Diffuse", *LOBE_SOCKETS):
            node.inputs[name].default_value = defaults[name].default_value
        material.nfm.mute = material.nfm.solo = (False,) * 3


register, unregister = register_classes_factory((NFM_OT_reset_material,))
