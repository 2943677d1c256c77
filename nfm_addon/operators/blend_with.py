# SPDX-License-Identifier: GPL-3.0-or-later
"""Blend a measured material with another one, by a slider."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.utils import register_classes_factory

from ...fitter.formats import parameter_file
from ...fitter.formats.parameter_file import FittedMaterial
from .. import editing
from ..errors import ShaderError
from .measured_material import EditOperator


class NFM_OT_blend_with(EditOperator, bpy.types.Operator):
    """bpy.ops.nfm.blend_with(material='steel')."""

    bl_idname = "nfm.blend_with"
    bl_label = "Blend With"
    bl_description = (
        "Choose a measured material to blend this one with, as it is now. The slider Blend goes "
        "from this one to that one, highlight by highlight"
    )

    material: StringProperty(
        name="Material",
        description="Name of the other material; empty for none",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: bpy.types.Context) -> None:
        self.layout.prop_search(self, "material", bpy.data, "materials")

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> None:
        edit = material.nfm.edit
        if not self.material:
            edit.blend, edit.blend_name, edit.blend_parameters = 0.0, "", ""
            return
        other = bpy.data.materials.get(self.material)
        if other is None or not other.nfm.parameters:
            message = rpt_("there is no measured material {!r}; import it first")
            raise ShaderError(message.format(self.material))
        model = editing.edited_model(other)
        own = editing.fitted_material(material).model
        if model.kind != own.kind:
            message = rpt_("{!r} is {:s} and {!r} {:s}; choose one of the same kind")
            raise ShaderError(message.format(other.name, model.kind, material.name, own.kind))
        edit.blend_parameters = parameter_file.dumps(FittedMaterial(other.name, model))
        edit.blend_name = other.name


register, unregister = register_classes_factory((NFM_OT_blend_with,))
