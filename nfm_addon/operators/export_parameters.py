# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a material's model to an .nfm.json file."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ExportHelper

from ...fitter.errors import shown_name
from ...fitter.formats import parameter_file
from .. import editing
from .measured_material import EditOperator, active_material


class NFM_OT_export_parameters(EditOperator, bpy.types.Operator, ExportHelper):
    """bpy.ops.nfm.export_parameters(filepath=...)."""

    bl_idname = "nfm.export_parameters"
    bl_label = "Export"
    bl_description = "Write the fitted model of this material, without edits, to an .nfm.json file"
    bl_options = {"REGISTER"}

    filename_ext = parameter_file.SUFFIX
    filepath: StringProperty(
        name="File",
        description="The .nfm.json file to write",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default=f"*{parameter_file.SUFFIX}", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            name = bpy.path.clean_name(active_material(context).name)
            self.filepath = f"{name}{parameter_file.SUFFIX}"
        return ExportHelper.invoke(self, context, event)

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> str:
        path = bpy.path.abspath(self.filepath)
        parameter_file.save(path, editing.fitted_material(material))
        return rpt_("Written: {:s}").format(shown_name(path))


register, unregister = register_classes_factory((NFM_OT_export_parameters,))
