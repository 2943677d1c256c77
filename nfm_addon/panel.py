# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel "Measured BRDF" in the properties of a material."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.utils import register_classes_factory

from .lamps import BLIND_SAMPLINGS, lamps_without_size
from .operators.give_lamps_size import NFM_OT_give_lamps_size


class NFM_PT_material(bpy.types.Panel):
    """What was measured, how it is sampled, and what that costs."""

    bl_idname = "NFM_PT_material"
    bl_label = "Measured BRDF"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(context.material and context.material.nfm.parameters)

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        settings = context.material.nfm
        if settings.source:
            layout.label(text=settings.source, translate=False)
        layout.prop(settings, "sampling")
        if settings.sampling == "NATIVE":
            layout.label(text=native_error_text(settings), translate=False)
        if settings.sampling in BLIND_SAMPLINGS:
            _draw_lamps(layout, context.scene)


def native_error_text(settings: bpy.types.PropertyGroup) -> str:
    """The error of native sampling in one line."""
    return iface_("Error {:.2f} %, {:.0f} dB").format(
        100 * settings.native_error, settings.native_psnr
    )


def _draw_lamps(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    lamps = lamps_without_size(scene)
    if not lamps:
        return
    box = layout.box()
    names = ", ".join(item.name for item in lamps)
    box.label(text=iface_("Not seen: {:s}").format(names), icon="ERROR")
    box.operator(NFM_OT_give_lamps_size.bl_idname)


register, unregister = register_classes_factory((NFM_PT_material,))
