# SPDX-License-Identifier: GPL-3.0-or-later
"""Import a whole folder of measured BRDFs as an asset library."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, StringProperty
from bpy.utils import register_classes_factory

from ...fitter.errors import NfmError
from ...fitter.jobs import batch
from ..fit_options import encoding_name, encoding_option, quality_option, wait_option
from ..fitting.folder import FolderImport, FolderItem
from ..fitting.queue import Job, queue
from ..formats import FILE_FILTER
from ..preferences import library_folder, preferences_of


class NFM_OT_import_folder(bpy.types.Operator):
    """bpy.ops.nfm.import_folder(directory=..., output='', quality='STANDARD')."""

    bl_idname = "nfm.import_folder"
    bl_label = "Import Folder"
    bl_description = (
        "Fit all measured BRDFs of a folder, one after the other beside the interface, and collect "
        "them as an asset library. Files that were fitted before are kept, those that cannot be "
        "fitted are listed; Esc stops, and the next time goes on"
    )
    bl_options = {"REGISTER"}

    directory: StringProperty(
        name="Folder",
        description="Folder of measured files",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    filter_glob: StringProperty(default=FILE_FILTER, options={"HIDDEN"})
    output: StringProperty(
        name="Output",
        description="Folder for the parameter files, the assets and the summary; empty: one of the "
        "same name in the folder that the preferences say",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    quality: quality_option("How long each fit may take")
    encoding: encoding_option()
    show: BoolProperty(
        name="Add to Asset Libraries",
        description="Show the output folder in the asset browser, by adding it to the asset "
        "libraries of the preferences",
        default=True,
    )
    wait: wait_option()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if not self.properties.is_property_set("quality"):
            self.quality = preferences_of(context).quality
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        for name in ("output", "quality", "encoding", "show"):
            layout.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        source = Path(bpy.path.abspath(self.directory))
        try:
            folder = FolderImport(
                source.name, *self._output_and_jobs(context, source), show=self.show
            )
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if self.wait or bpy.app.background:
            return self._fit_all(folder)
        for job in folder.jobs:
            landing = FolderItem(folder, job)
            queue.add(
                Job(str(job.path), self.quality.lower(), landing, encoding_name(self.encoding))
            )
        bpy.ops.nfm.watch_fits("INVOKE_DEFAULT")
        return {"FINISHED"}

    def _output_and_jobs(
        self, context: bpy.types.Context, source: Path
    ) -> tuple[Path, list[batch.Job]]:
        chosen = bpy.path.abspath(self.output)
        output = Path(chosen) if chosen else library_folder(context) / source.name
        jobs = batch.jobs_of(source, output)  # before a folder is made for nothing
        return batch.made_folder(output), jobs

    def _fit_all(self, folder: FolderImport) -> set[str]:
        settings = batch.Settings(
            quality=self.quality.lower(), encoding=encoding_name(self.encoding)
        )
        for job in folder.jobs:
            message = folder.take(batch.fit_one(job, settings))
        self.report({"INFO"}, message)
        return {"FINISHED"}


def _menu_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    text = rpt_("Folder of Measured BRDFs")
    menu.layout.operator(NFM_OT_import_folder.bl_idname, text=text, translate=False)


_register_classes, _unregister_classes = register_classes_factory((NFM_OT_import_folder,))


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_file_import.append(_menu_entry)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu_entry)
    _unregister_classes()
