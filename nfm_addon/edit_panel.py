# SPDX-License-Identifier: GPL-3.0-or-later
"""The part "Lobes & Curves" of the panel Measured BRDF."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.utils import register_classes_factory

from ..fitter.editing.curves import curves_of_lobe
from . import curve_nodes, editing
from .edit_properties import DIRECTIONAL_SLIDERS, LOBE_SLIDERS, LOBES
from .node_group import kind_of
from .operators.blend_with import NFM_OT_blend_with
from .operators.copy_edits import (
    NFM_OT_copy_curve,
    NFM_OT_copy_lobe,
    NFM_OT_paste_curve,
    NFM_OT_paste_lobe,
)
from .operators.reset_edits import NFM_OT_keep_energy, NFM_OT_reset_edits
from .panel_text import units_across
from .places import InMaterialProperties, InShaderEditor

# The albedo shown is of a coarse integral, up to 0.2 % off.
TOO_MUCH_LIGHT = 1.005


# Units across below which "Highlight Width" does not fit beside its slider.
NARROW = 14


class _LobesAndCurves:
    """Sliders above, curves below, lobe by lobe."""

    bl_label = "Lobes & Curves"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return editing.has_own_nodes(context.material)

    def draw(self, context: bpy.types.Context) -> None:
        # a label beside its slider is cut off in a narrow panel; within the slider it is not
        self.layout.use_property_split = units_across(context) > NARROW
        draw_edit(self.layout, context.material)


class NFM_PT_edit(InMaterialProperties, _LobesAndCurves, bpy.types.Panel):
    """In the panel of the material."""

    bl_idname = "NFM_PT_edit"
    bl_parent_id = "NFM_PT_material"


class NFM_PT_edit_nodes(InShaderEditor, _LobesAndCurves, bpy.types.Panel):
    """In that beside the nodes."""

    bl_idname = "NFM_PT_edit_nodes"
    bl_parent_id = "NFM_PT_material_nodes"


def draw_edit(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    """All there is to edit of a measured material."""
    edit = material.nfm.edit
    layout.prop(edit, "show_original", toggle=True)
    _draw_energy(layout, material)
    group = editing.group_of(material)
    kind = kind_of(group)
    for number, lobe in enumerate(LOBES):
        header, body = layout.panel(f"NFM_PT_{lobe}", default_closed=number > 0)
        header.label(text=iface_("Lobe {:d}").format(number + 1), translate=False)
        header.operator(NFM_OT_copy_lobe.bl_idname, text="", icon="COPYDOWN").lobe = number + 1
        header.operator(NFM_OT_paste_lobe.bl_idname, text="", icon="PASTEDOWN").lobe = number + 1
        if body:
            for name in LOBE_SLIDERS:
                if kind == "anisotropic" or name not in DIRECTIONAL_SLIDERS:
                    body.prop(getattr(edit, lobe), name)
            for curve in curves_of_lobe(number, kind):
                _draw_curve(body, group, curve)
    _draw_color(layout, material, group)
    _draw_blend(layout, edit)
    layout.operator(NFM_OT_reset_edits.bl_idname, text="Reset All").what = "ALL"


def _draw_energy(layout: bpy.types.UILayout, material: bpy.types.Material) -> None:
    albedo = editing.largest_albedo(material)
    if albedo > TOO_MUCH_LIGHT:
        text = iface_("Reflects {:.0%} of the light").format(albedo)
        layout.label(text=text, icon="ERROR", translate=False)
    edit = material.nfm.edit
    if edit.keep_energy:
        layout.prop(edit, "keep_energy")
    elif albedo > TOO_MUCH_LIGHT:
        layout.operator(NFM_OT_keep_energy.bl_idname)


def _draw_color(
    layout: bpy.types.UILayout, material: bpy.types.Material, group: bpy.types.ShaderNodeTree
) -> None:
    edit = material.nfm.edit
    header, body = layout.panel("NFM_PT_color", default_closed=True)
    header.label(text="Colour")
    if body:
        for name in ("edge_tint", "edge_strength"):
            body.prop(edit, name)
        column = body.column(heading="Reflections", align=True)
        column.prop(edit, "specular_saturation")
        column.prop(edit, "specular_hue")
        column = body.column(heading="Body", align=True)
        column.prop(edit, "diffuse_saturation")
        column.prop(edit, "diffuse_hue")
        _draw_curve(body, group, curve_nodes.FRESNEL_NODE)


def _draw_curve(layout: bpy.types.UILayout, group: bpy.types.ShaderNodeTree, name: str) -> None:
    node = curve_nodes.node_of(group, name)
    row = layout.row(align=True)
    row.label(text=iface_(node.label if node else name), translate=False)
    for operator, icon in ((NFM_OT_copy_curve, "COPYDOWN"), (NFM_OT_paste_curve, "PASTEDOWN")):
        row.operator(operator.bl_idname, text="", icon=icon).curve = name
    row.operator(NFM_OT_reset_edits.bl_idname, text="", icon="LOOP_BACK").what = name
    if node:
        kind = "COLOR" if name == curve_nodes.FRESNEL_NODE else "NONE"
        layout.template_curve_mapping(node, "mapping", type=kind)


def _draw_blend(layout: bpy.types.UILayout, edit: bpy.types.PropertyGroup) -> None:
    row = layout.row(align=True)
    if edit.blend_name:
        row.prop(edit, "blend", text=iface_("Blend: {:s}").format(edit.blend_name), translate=False)
        row.operator(NFM_OT_blend_with.bl_idname, text="", icon="GREASEPENCIL")
    else:
        row.operator(NFM_OT_blend_with.bl_idname)


register, unregister = register_classes_factory((NFM_PT_edit, NFM_PT_edit_nodes))
