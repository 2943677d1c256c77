# SPDX-License-Identifier: GPL-3.0-or-later
"""Take edits back, one curve or all, and keep an edited material within the energy there is."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty
from bpy.utils import register_classes_factory

from ...fitter.editing.edits import Sliders
from .. import editing
from ..edit_properties import set_sliders
from ..editing.parts import CURVE_PARTS, curve_part
from .measured_material import EditOperator

RESET_ITEMS = (
    ("ALL", "All", "Every curve and slider"),
    ("CURVES", "Curves", "Every curve; sliders stay"),
    ("SLIDERS", "Sliders", "Every slider; curves stay"),
    *((name, name, "One curve; F are all four colour curves") for name in CURVE_PARTS),
)


class NFM_OT_reset_edits(EditOperator, bpy.types.Operator):
    """bpy.ops.nfm.reset_edits(what='ALL')."""

    bl_idname = "nfm.reset_edits"
    bl_label = "Reset"
    bl_description = "Set curves, sliders or both back to what was measured"

    what: EnumProperty(
        name="What",
        description="What is set back",
        items=RESET_ITEMS,
        default="ALL",
        options={"SKIP_SAVE"},
    )

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> None:
        edit = material.nfm.edit
        if self.what in ("ALL", "SLIDERS"):
            set_sliders(edit, Sliders())
        if self.what == "ALL":
            edit.blend = 0.0
            edit.show_original = edit.keep_energy = False
        if self.what in ("ALL", "CURVES"):
            editing.reset_curves(material)
        elif self.what != "SLIDERS":
            editing.reset_curves(material, tuple(curve_part(self.what).curves.values()))


class NFM_OT_keep_energy(EditOperator, bpy.types.Operator):
    """bpy.ops.nfm.keep_energy()."""

    bl_idname = "nfm.keep_energy"
    bl_label = "Keep Energy"
    bl_description = (
        "Lower the lobes where the edited material reflects more light than it receives, from now "
        "on and after every further edit"
    )

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> None:
        material.nfm.edit.keep_energy = True


register, unregister = register_classes_factory((NFM_OT_reset_edits, NFM_OT_keep_energy))
