# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the active material again, or give it the model of another file."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ImportHelper

from ...fitter.errors import NfmError
from ...fitter.jobs.fit_file import is_parameter_file, material_from_file
from .. import editing
from ..fit_options import encoding_name, encoding_option, quality_option, wait_option
from ..fitting.landing import ExistingMaterial
from ..fitting.queue import FitResult, Job, queue
from ..formats import FILE_FILTER
from .measured_material import OwnMaterialOperator, active_material


class _Fits(OwnMaterialOperator):
    """What both operators share: the options, and putting a file's model into a material."""

    quality: quality_option("How long the fit may take")
    wait: wait_option()

    def _put_model_of(
        self, path: str, context: bpy.types.Context, encoding: str | None
    ) -> set[str]:
        item = active_material(context)
        waits = self.wait or bpy.app.background
        place = ExistingMaterial(item.session_uid, path, self.bl_label, waits)
        if not (waits or is_parameter_file(path)):
            queue.add(Job(path, self.quality.lower(), place, encoding))
            bpy.ops.nfm.watch_fits("INVOKE_DEFAULT")
            return {"FINISHED"}
        try:
            fitted = material_from_file(path, encoding=encoding, quality=self.quality.lower())
            self.report({"INFO"}, place.final(FitResult(fitted)))
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class NFM_OT_refit(_Fits, bpy.types.Operator):
    """bpy.ops.nfm.refit(quality='BEST')."""

    bl_idname = "nfm.refit"
    bl_label = "Refit"
    bl_description = (
        "Fit the material's measured file again, with another quality. Scales and links stay"
    )
    bl_options = {"REGISTER"}

    encoding: encoding_option("as it was taken before")

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        path = bpy.path.abspath(active_material(context).nfm.source_path)
        if not Path(path).is_file() or is_parameter_file(path):
            self.report({"INFO"}, rpt_("Where is the measured file?"))
            return bpy.ops.nfm.replace_measurement("INVOKE_DEFAULT", quality=self.quality)
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        item = active_material(context)
        path = item.nfm.source_path
        if not path:
            self.report({"ERROR"}, rpt_("Where the measured file is, is not known; use Replace"))
            return {"CANCELLED"}
        try:
            known = editing.fitted_material(item).fit.get("encoding")
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        encoding = encoding_name(self.encoding) or known
        return self._put_model_of(bpy.path.abspath(path), context, encoding)


class NFM_OT_replace_measurement(_Fits, bpy.types.Operator, ImportHelper):
    """bpy.ops.nfm.replace_measurement(filepath=...)."""

    bl_idname = "nfm.replace_measurement"
    bl_label = "Replace"
    bl_description = (
        "Give this material the model of another file, measured or fitted. Its name, users, scales "
        "and links stay"
    )
    bl_options = {"REGISTER"}

    filepath: StringProperty(
        name="File",
        description="A measured file or an .nfm.json file",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default=FILE_FILTER, options={"HIDDEN"})
    encoding: encoding_option()

    def execute(self, context: bpy.types.Context) -> set[str]:
        path = bpy.path.abspath(self.filepath)
        return self._put_model_of(path, context, encoding_name(self.encoding))


register, unregister = register_classes_factory((NFM_OT_refit, NFM_OT_replace_measurement))
