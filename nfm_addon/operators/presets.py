# SPDX-License-Identifier: GPL-3.0-or-later
"""Models kept in a folder of the user's, to give them to other materials."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.utils import register_classes_factory

from ...fitter import parameter_file
from ...fitter.errors import NfmError
from .. import material as materials
from ..context import NeedsMaterial, measured_material
from ..formats import FILE_FILTER
from ..preferences import library_folder


class NFM_OT_save_preset(NeedsMaterial, bpy.types.Operator):
    """bpy.ops.nfm.save_preset(name='gold')."""

    bl_idname = "nfm.save_preset"
    bl_label = "Save as Preset"
    bl_description = "Keep the fitted model of this material in the library folder"
    bl_options = {"REGISTER"}

    name: StringProperty(
        name="Name",
        description="Of the preset; one of that name is replaced",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        self.name = measured_material(context).name
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        item = measured_material(context)
        name = self.name.strip() or item.name
        folder = library_folder(context)
        # letters and digits of a stranger's name: nothing that leaves the folder
        path = folder / f"{bpy.path.clean_name(name)}{parameter_file.SUFFIX}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            parameter_file.save(path, replace(materials.fitted_material(item), name=name))
        except (NfmError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, rpt_("Preset {:s} saved").format(name))
        return {"FINISHED"}


class NFM_OT_load_preset(NeedsMaterial, bpy.types.Operator):
    """bpy.ops.nfm.load_preset('INVOKE_DEFAULT')."""

    bl_idname = "nfm.load_preset"
    bl_label = "Load Preset"
    bl_description = "Give this material the model of a preset from the library folder"
    bl_options = {"REGISTER"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        folder = library_folder(context)
        folder.mkdir(parents=True, exist_ok=True)
        return bpy.ops.nfm.replace_measurement(
            "INVOKE_DEFAULT", filepath=f"{folder}/", filter_glob=FILE_FILTER
        )

    def execute(self, _context: bpy.types.Context) -> set[str]:
        self.report({"ERROR"}, rpt_("Scripts: bpy.ops.nfm.replace_measurement(filepath=...)"))
        return {"CANCELLED"}


register, unregister = register_classes_factory((NFM_OT_save_preset, NFM_OT_load_preset))
