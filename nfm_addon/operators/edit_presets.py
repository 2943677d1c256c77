# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits as presets: .nfm.json files that hold the measured tables and, apart, what was edited."""

from __future__ import annotations

from dataclasses import replace

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...fitter.errors import ParameterFileError, shown_name
from ...fitter.formats import parameter_file
from .. import editing
from ..preferences import library_folder
from .measured_material import EditOperator, MaterialOperator, active_material


class NFM_OT_save_edits(MaterialOperator, bpy.types.Operator, ExportHelper):
    """bpy.ops.nfm.save_edits(filepath=...)."""

    bl_idname = "nfm.save_edits"
    bl_label = "Save as Preset"
    bl_description = (
        "Save the material with its edits: importing the file gives it back, and its edits can be "
        "loaded into another material"
    )
    bl_options = {"REGISTER"}

    filename_ext = parameter_file.SUFFIX
    filepath: StringProperty(
        name="File",
        description="The file to write",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.nfm.json", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            name = bpy.path.clean_name(active_material(context).name)
            self.filepath = str(library_folder(context) / f"{name}{parameter_file.SUFFIX}")
        return ExportHelper.invoke(self, context, event)

    def act(self, _context: bpy.types.Context, material: bpy.types.Material) -> str:
        path = bpy.path.abspath(self.filepath)
        fitted = editing.fitted_material(material)
        edits = editing.document_of(material)
        parameter_file.save(path, replace(fitted, name=material.name, edits=edits))
        return rpt_("Saved {:s}").format(shown_name(path))


class NFM_OT_load_edits(EditOperator, bpy.types.Operator, ImportHelper):
    """bpy.ops.nfm.load_edits(filepath=...)."""

    bl_idname = "nfm.load_edits"
    bl_label = "Load Edits"
    bl_description = "Give this material the sliders and edited curves of a preset"

    filepath: StringProperty(
        name="File",
        description="The preset to read",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.nfm.json", options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            self.filepath = f"{library_folder(context)}/"
        return ImportHelper.invoke(self, context, event)

    def change(self, _context: bpy.types.Context, material: bpy.types.Material) -> None:
        path = bpy.path.abspath(self.filepath)
        edits = parameter_file.load(path).edits
        if edits is None:
            raise ParameterFileError(
                f"{shown_name(path)}: a fit without edits; choose a file of Save as Preset"
            )
        editing.apply_document(material, edits)


register, unregister = register_classes_factory((NFM_OT_save_edits, NFM_OT_load_edits))
