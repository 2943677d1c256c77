# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a material as a file of measurements that other renderers read."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ExportHelper

from ...fitter.errors import NfmError, shown_name
from ...fitter.formats import export
from .. import editing
from ..editing.rendered_model import linked_colors, rendered_model
from .measured_material import OwnMaterialOperator, active_material


class NFM_OT_export_measurement(OwnMaterialOperator, bpy.types.Operator, ExportHelper):
    """bpy.ops.nfm.export_measurement(filepath=..., edited=True)."""

    bl_idname = "nfm.export_measurement"
    bl_label = "Export as Measurement"
    bl_description = (
        "Write the values of the material to a MERL .binary file (35 MB) or a UTIA .bin file, for "
        "renderers that read those. Anisotropic materials need .bin"
    )
    bl_options = {"REGISTER"}

    filename_ext = ""
    filepath: StringProperty(
        name="File",
        description="The .binary or .bin file to write",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default="*.binary;*.bin", options={"HIDDEN"})
    edited: BoolProperty(
        name="With Edits",
        description="As it is rendered, with curves, sliders and the colours of the node, or as it "
        "was fitted",
        default=True,
    )

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            material = active_material(context)
            try:
                kind = editing.fitted_material(material).model.kind
            except NfmError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            suffix = export.suffix_for(kind)
            self.filepath = f"{bpy.path.clean_name(material.name)}{suffix}"
        return ExportHelper.invoke(self, context, event)

    def check(self, _context: bpy.types.Context) -> bool:
        """Leave the suffix alone, which chooses the format."""
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        material = active_material(context)
        path = Path(bpy.path.abspath(self.filepath))
        try:
            linked = linked_colors(material) if self.edited else []
            if self.edited:
                model = rendered_model(material)
            else:
                model = editing.fitted_material(material).model
            export.write(path, model)
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if linked:
            message = rpt_("Written: {:s}; {:s} come from other nodes and were left as fitted")
            self.report({"WARNING"}, message.format(shown_name(path), ", ".join(linked)))
        else:
            self.report({"INFO"}, rpt_("Written: {:s}").format(shown_name(path)))
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_export_measurement,))
