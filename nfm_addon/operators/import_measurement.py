# SPDX-License-Identifier: GPL-3.0-or-later
"""Import measured BRDFs: fit them outside the interface and put the materials on objects."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ImportHelper

from ...fitter.errors import MeasurementError, NfmError
from ...fitter.formats import readers
from ...fitter.jobs.fit_file import is_parameter_file, material_from_file
from .. import drop, formats
from ..assignment import targets_of
from ..fit_options import encoding_name, encoding_option, quality_option, wait_option
from ..fitting import landing
from ..fitting.queue import FitResult, Job, queue
from ..formats import DROPPED_SUFFIXES, FILE_FILTER, SUFFIXES
from ..panel_text import fact
from ..preferences import preferences_of
from ..properties import DEFAULT_SAMPLING, SAMPLING_ITEMS


class NFM_OT_import_measurement(bpy.types.Operator, ImportHelper):
    """bpy.ops.nfm.import_measurement(filepath=..., sampling='NATIVE', quality='STANDARD')."""

    bl_idname = "nfm.import_measurement"
    bl_label = "Import BRDF"
    bl_description = (
        "Fit measured BRDFs or load fitted ones (.nfm.json), and put the material on the selected "
        "objects. The format is recognised by the content. Fits run beside the interface; Esc "
        "cancels them"
    )
    # no UNDO: the step is made when the material is, see fitting/landing.py
    bl_options = {"REGISTER", "PRESET"}

    filepath: StringProperty(
        name="File",
        description="A measured file or an .nfm.json file",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    filter_glob: StringProperty(default=FILE_FILTER, options={"HIDDEN"})
    quality: quality_option("How long the fit of a measured file may take")
    sampling: EnumProperty(
        name="Sampling",
        description="How Cycles samples the material; can be changed later",
        items=SAMPLING_ITEMS,
        default=DEFAULT_SAMPLING,
    )
    encoding: encoding_option()
    assign: BoolProperty(
        name="Assign to Selection",
        description="Put the material on the selected objects, or the active one where none is "
        "selected; of several files the first. Others are kept with a fake user",
        default=True,
    )
    as_asset: BoolProperty(
        name="Mark as Asset",
        description="Show the material in the asset browser, with a picture and tags",
        default=False,
    )
    wait: wait_option()

    _targets: list[int] | None = None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.properties.is_property_set("quality"):
            self.quality = preferences_of(context).quality
        if not self.files:
            return ImportHelper.invoke(self, context, event)
        if target := drop.target(context, event):
            self._targets = [target.session_uid]
        return self.execute(context)

    def draw(self, context: bpy.types.Context) -> None:
        path = formats.chosen(context) or self.filepath
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        found = formats.name_of(path)
        fact(layout, iface_("Format"), found or iface_("By content"))
        column = layout.column()
        column.enabled = found != "NFM"  # which needs no fit
        column.prop(self, "quality")
        layout.prop(self, "sampling")
        row = layout.row()
        row.enabled = formats.has_encodings(path)
        row.prop(self, "encoding")
        column = layout.column(align=True)
        column.prop(self, "assign")
        column.prop(self, "as_asset")

    def execute(self, context: bpy.types.Context) -> set[str]:
        targets = self._targets or targets_of(context) if self.assign else []
        waits = self.wait or bpy.app.background
        done = 0
        paths = self._paths()
        for number, path in enumerate(paths):
            place = landing.NewMaterial(
                path, self.sampling, [] if number else targets, self.as_asset, waits
            )
            # one fitted material is there at once; a whole library of them would be felt
            if waits or (len(paths) == 1 and is_parameter_file(path)):
                done += self._land(context, place)
            else:
                queue.add(Job(path, self.quality.lower(), place, self._encoding_of(path)))
                done += 1
        if queue.jobs and not waits:
            bpy.ops.nfm.watch_fits("INVOKE_DEFAULT")
        return {"FINISHED"} if done else {"CANCELLED"}

    def _paths(self) -> list[str]:
        if self.files and self.directory:
            folder = Path(bpy.path.abspath(self.directory))
            return [str(folder / item.name) for item in self.files]
        return [bpy.path.abspath(self.filepath)]

    def _encoding_of(self, path: str) -> str | None:
        """As chosen, for files that have a choice: several formats may come at once."""
        try:
            return readers.offered_encoding(path, encoding_name(self.encoding))
        except MeasurementError:
            return None  # the reader says what is wrong with the file

    def _land(self, context: bpy.types.Context, place: landing.NewMaterial) -> bool:
        """Fit or load at once; whether that went well."""
        progress = context.window_manager
        progress.progress_begin(0, 1)
        try:
            fitted = material_from_file(
                place.path,
                encoding=self._encoding_of(place.path),
                quality=self.quality.lower(),
                on_step=lambda step: progress.progress_update(step.progress),
            )
            message = place.final(FitResult(fitted))
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return False
        finally:
            progress.progress_end()
        self.report({"INFO" if place.is_assigned or not self.assign else "WARNING"}, message)
        return True


class NFM_FH_measured_brdf(bpy.types.FileHandler):
    """Files dropped onto the 3D viewport or a shader editor."""

    bl_idname = "NFM_FH_measured_brdf"
    bl_label = "Measured BRDF"
    bl_import_operator = NFM_OT_import_measurement.bl_idname
    bl_file_extensions = DROPPED_SUFFIXES

    @classmethod
    def poll_drop(cls, context: bpy.types.Context) -> bool:
        return drop.takes_drops(context)


def _menu_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    text = rpt_("Measured BRDF ({:s})").format(", ".join(SUFFIXES))
    menu.layout.operator(NFM_OT_import_measurement.bl_idname, text=text, translate=False)


_register_classes, _unregister_classes = register_classes_factory(
    (NFM_OT_import_measurement, NFM_FH_measured_brdf)
)


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_file_import.append(_menu_entry)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu_entry)
    _unregister_classes()
