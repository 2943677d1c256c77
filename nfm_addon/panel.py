# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel "Measured BRDF": in the properties of a material and beside the shader editor."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.utils import register_classes_factory

from ..fitter.errors import NfmError
from ..fitter.factors import N_LOBES
from . import material as materials
from . import plot_icons
from .direction_panel import draw_direction
from .figures import native_error_text, quality_lines, warnings
from .lamps import BLIND_SAMPLINGS, lamps_without_size
from .node_group import LOBE_SOCKETS
from .operators.give_lamps_size import NFM_OT_give_lamps_size
from .render_setup import obstacles


class NFM_PT_material(bpy.types.Panel):
    """What was measured, how it is sampled, and what that costs."""

    bl_idname = "NFM_PT_material"
    bl_label = "Measured BRDF"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_measured(context.material)

    def draw(self, context: bpy.types.Context) -> None:
        draw_material(self.layout, context, context.material)


class NFM_PT_material_nodes(bpy.types.Panel):
    """The same in the sidebar of the shader editor."""

    bl_idname = "NFM_PT_material_nodes"
    bl_label = "Measured BRDF"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Measured BRDF"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_measured(getattr(context, "material", None))

    def draw(self, context: bpy.types.Context) -> None:
        draw_material(self.layout, context, context.material)


def is_measured(item: bpy.types.Material | None) -> bool:
    """Whether a material was made by the add-on."""
    return bool(item and item.nfm.parameters)


def draw_material(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    """Draw everything about a material of ours."""
    settings = item.nfm
    layout.use_property_split = True
    layout.use_property_decorate = False
    _draw_set_up(layout, context)
    _draw_origin(layout, settings)
    layout.prop(settings, "sampling")
    if settings.sampling == "NATIVE":
        layout.label(text=native_error_text(settings), translate=False)
    if settings.sampling in BLIND_SAMPLINGS:
        _draw_lamps(layout, context.scene)
    _draw_lobes(layout, item)
    _draw_plot(layout, context, item)
    _draw_actions(layout)


def _draw_set_up(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    found = obstacles(context)
    if not found:
        return
    box = layout.box()
    for obstacle in found:
        box.label(text=obstacle.problem, icon="ERROR", translate=False)
    if any(obstacle.remove for obstacle in found):
        box.operator("nfm.set_up_render")


def _draw_origin(layout: bpy.types.UILayout, settings: bpy.types.PropertyGroup) -> None:
    column = layout.column(align=True)
    if settings.source:
        name = f"{settings.source} ({settings.source_format.upper()})"
        column.label(text=name, icon="FILE", translate=False)
    model = iface_("Three lobes, {:d} numbers").format(settings.numbers)
    column.label(text=model, translate=False)
    for line in quality_lines(settings):
        column.label(text=line, translate=False)
    for line in warnings(settings):
        column.label(text=line, icon="ERROR", translate=False)


def _draw_lamps(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    lamps = lamps_without_size(scene)
    if not lamps:
        return
    box = layout.box()
    names = ", ".join(item.name for item in lamps)
    box.label(text=iface_("Not seen: {:s}").format(names), icon="ERROR", translate=False)
    box.operator(NFM_OT_give_lamps_size.bl_idname)


def _draw_lobes(layout: bpy.types.UILayout, item: bpy.types.Material) -> None:
    try:
        inputs = materials.find_group_node(item).inputs
    except NfmError as error:
        layout.label(text=str(error), icon="ERROR", translate=False)
        return
    column = layout.column(align=True)
    column.prop(inputs["Diffuse"], "default_value", text="Diffuse")
    for lobe in range(N_LOBES):
        row = column.row(align=True)
        scale = inputs[LOBE_SOCKETS[lobe]]
        row.prop(scale, "default_value", text=iface_("Lobe {:d}").format(lobe + 1))
        row.prop(item.nfm, "solo", index=lobe, text="", icon="SOLO_ON")
        row.prop(item.nfm, "mute", index=lobe, text="", icon="HIDE_ON")
    draw_direction(layout, item)


def _draw_plot(
    layout: bpy.types.UILayout, context: bpy.types.Context, item: bpy.types.Material
) -> None:
    settings = context.window_manager.nfm_plot
    column = layout.column()
    column.use_property_split = False
    column.row(align=True).prop(settings, "kind", expand=True)
    try:
        icon = plot_icons.icons.icon_of(item, settings.kind)
    except NfmError as error:
        column.label(text=str(error), icon="ERROR", translate=False)
        return
    column.template_icon(icon_value=icon, scale=settings.size)
    column.prop(settings, "size", slider=True)


def _draw_actions(layout: bpy.types.UILayout) -> None:
    column = layout.column(align=True)
    for names in (
        ("refit", "replace_measurement", "reset_material"),
        ("export_parameters", "save_edits", "load_edits"),
    ):
        row = column.row(align=True)
        for name in names:
            row.operator(f"nfm.{name}")


register, unregister = register_classes_factory((NFM_PT_material, NFM_PT_material_nodes))
