# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel "Measured BRDF": in the properties of a material and beside the shader editor."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.utils import register_classes_factory

from ..fitter.errors import NfmError, shown_name
from ..fitter.models.factors import N_LOBES
from . import material as materials
from . import plot_icons
from .direction_panel import draw_direction
from .figures import facts, native_error_text, warnings
from .lamps import BLIND_SAMPLINGS, lamps_without_size
from .node_group import LOBE_SOCKETS
from .operators.give_lamps_size import NFM_OT_give_lamps_size
from .operators.make_editable import is_fixed
from .panel_text import fact, paragraph, units_across
from .places import InMaterialProperties, InShaderEditor
from .render_setup import obstacles


class _MeasuredBrdf:
    """What was measured, how it is sampled, and what that costs."""

    bl_label = "Measured BRDF"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_measured(getattr(context, "material", None))

    def draw(self, context: bpy.types.Context) -> None:
        draw_material(self.layout, context, context.material)


class NFM_PT_material(InMaterialProperties, _MeasuredBrdf, bpy.types.Panel):
    """Above the panels that every material has, where Blender puts those without a header.

    So it brings one itself.
    """

    bl_idname = "NFM_PT_material"
    bl_options = {"HIDE_HEADER"}

    def draw(self, context: bpy.types.Context) -> None:
        header, body = self.layout.panel("NFM_PT_measured")
        header.label(text=self.bl_label)
        if body:
            draw_material(body, context, context.material)


class NFM_PT_material_nodes(InShaderEditor, _MeasuredBrdf, bpy.types.Panel):
    """The same beside the nodes."""

    bl_idname = "NFM_PT_material_nodes"


def is_measured(item: bpy.types.Material | None) -> bool:
    """Whether a material was made by the add-on."""
    return bool(item and item.nfm.parameters)


def draw_material(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    """Draw everything about a material of ours."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    _draw_set_up(layout, context)
    _draw_library(layout, context, item)
    _draw_origin(layout, context, item.nfm)
    _draw_sampling(layout, context, item.nfm)
    _draw_lobes(layout, context, item)
    _draw_actions(layout)
    _draw_plot(layout, context, item)


def _draw_set_up(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    found = obstacles(context)
    if not found:
        return
    box = layout.box()
    for obstacle in found:
        paragraph(box, context, obstacle.problem, "ERROR")
    if any(obstacle.remove for obstacle in found):
        box.operator("nfm.set_up_render")


def _draw_library(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    if item.library:
        box = layout.box()
        text = iface_("Linked from {:s}").format(shown_name(item.library.filepath))
        paragraph(box, context, text, "LINKED")
        box.operator("nfm.make_editable")
    elif item.override_library:
        box = layout.box()
        if is_fixed(item):
            paragraph(
                box, context, iface_("Library override, not edited yet"), "LIBRARY_DATA_OVERRIDE"
            )
            box.operator("nfm.make_editable")
        else:
            # Blender stores no values of sockets in an override
            text = iface_(
                "Library override: colours typed into its node are lost when the file is saved; "
                "the sliders below are kept"
            )
            paragraph(box, context, text, "LIBRARY_DATA_OVERRIDE")


def _draw_origin(
    layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    column = layout.column(align=True)
    for name, text in facts(settings):
        fact(column, name, text)
    for line in warnings(settings):
        paragraph(column, context, line, "ERROR")


def _draw_sampling(
    layout: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup
) -> None:
    column = layout.column(align=True)
    column.prop(settings, "sampling")
    if settings.sampling == "NATIVE":
        fact(column, "Error", native_error_text(settings))
    if settings.sampling in BLIND_SAMPLINGS:
        _draw_lamps(column, context)


def _draw_lamps(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    lamps = lamps_without_size(context.scene)
    if not lamps:
        return
    box = layout.box()
    names = ", ".join(item.name for item in lamps)
    paragraph(box, context, iface_("Not seen: {:s}").format(names), "ERROR")
    box.operator(NFM_OT_give_lamps_size.bl_idname)


def _draw_lobes(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    try:
        inputs = materials.find_group_node(item).inputs
    except NfmError as error:
        paragraph(layout, context, str(error), "ERROR")
        return
    column = layout.column(align=True)
    row = column.row(align=True)
    row.prop(inputs["Diffuse"], "default_value", text="Diffuse")
    for _ in ("solo", "mute"):
        row.label(icon="BLANK1")
    for lobe in range(N_LOBES):
        row = column.row(align=True)
        scale = inputs[LOBE_SOCKETS[lobe]]
        row.prop(scale, "default_value", text=iface_("Lobe {:d} Scale").format(lobe + 1))
        solo, mute = item.nfm.solo[lobe], item.nfm.mute[lobe]
        row.prop(item.nfm, "solo", index=lobe, text="", icon="SOLO_ON" if solo else "SOLO_OFF")
        row.prop(item.nfm, "mute", index=lobe, text="", icon="HIDE_ON" if mute else "HIDE_OFF")
    draw_direction(layout, item)


def _draw_actions(layout: bpy.types.UILayout) -> None:
    column = layout.column(align=True)
    for names in (
        ("refit", "replace_measurement"),
        ("export_parameters", "export_measurement"),
        ("save_edits", "load_edits"),
        ("reset_material",),
    ):
        row = column.row(align=True)
        for name in names:
            row.operator(f"nfm.{name}")


def _draw_plot(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    settings = context.window_manager.nfm_plot
    header, body = layout.panel("NFM_PT_plot")
    header.label(text="Plot")
    if not body:
        return
    body.use_property_split = False
    column = body.column(align=True)
    column.row(align=True).prop(settings, "kind", expand=True)
    try:
        icon = plot_icons.icons.icon_of(item, settings.kind)
    except NfmError as error:
        paragraph(column, context, str(error), "ERROR")
        return
    column.template_icon(icon_value=icon, scale=min(settings.size, units_across(context)))
    caption = column.row()
    caption.alignment = "CENTER"
    caption.label(text=plot_icons.CAPTIONS[settings.kind])
    legend = column.row()
    legend.alignment = "CENTER"
    for text, color in plot_icons.LEGENDS[settings.kind]:
        legend.label(text=text, icon_value=plot_icons.icons.swatch(color))
    column.separator()
    column.prop(settings, "size", slider=True)


register, unregister = register_classes_factory((NFM_PT_material, NFM_PT_material_nodes))
