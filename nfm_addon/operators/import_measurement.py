# SPDX-License-Identifier: GPL-3.0-or-later
"""Import a measured BRDF: fit it and put the material on the active object."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, StringProperty
from bpy.utils import register_classes_factory
from bpy_extras.io_utils import ImportHelper

from ...fitter.errors import NfmError
from ...fitter.fit_file import material_from_file
from ...fitter.quality import DEFAULT_QUALITY
from .. import material
from ..properties import DEFAULT_SAMPLING, SAMPLING_ITEMS

QUALITY_ITEMS = (
    ("DRAFT", "Draft", "A first look, in about 2 seconds"),
    ("STANDARD", "Standard", "For most uses, in less than 10 seconds"),
    ("BEST", "Best", "More starts and steps, in less than 40 seconds; seldom looks different"),
)


class NFM_OT_import_measurement(bpy.types.Operator, ImportHelper):
    """bpy.ops.nfm.import_measurement(filepath=..., sampling='NATIVE', quality='STANDARD')."""

    bl_idname = "nfm.import_measurement"
    bl_label = "Import Measured BRDF"
    bl_description = (
        "Fit a measured BRDF (MERL .binary) or load a fitted one (.nfm.json) and put the material "
        "on the active object"
    )
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.binary;*.nfm.json", options={"HIDDEN"})
    sampling: EnumProperty(
        name="Sampling",
        description="How Cycles samples the material",
        items=SAMPLING_ITEMS,
        default=DEFAULT_SAMPLING,
    )
    quality: EnumProperty(
        name="Quality",
        description="How long the fit of a measured file may take",
        items=QUALITY_ITEMS,
        default=DEFAULT_QUALITY.upper(),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        progress = context.window_manager
        progress.progress_begin(0, 1)
        try:
            fitted = material_from_file(
                bpy.path.abspath(self.filepath),
                quality=self.quality.lower(),
                on_step=lambda step: progress.progress_update(step.progress),
            )
            new = material.build(fitted, self.sampling)
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            progress.progress_end()
        target = context.active_object
        if assign(target, new):
            message = rpt_("{:s} is on {:s}").format(new.name, target.name)
            if self.sampling == "NATIVE":
                error = rpt_("; error of native sampling {:.2f} %")
                message += error.format(100 * new.nfm.native_error)
            self.report({"INFO"}, message)
        else:
            # without a user it would vanish when the file is saved
            new.use_fake_user = True
            message = rpt_("{:s}: no active object takes materials; find it in the material list")
            self.report({"WARNING"}, message.format(new.name))
        return {"FINISHED"}


def assign(target: bpy.types.Object | None, new: bpy.types.Material) -> bool:
    """Put a material into the active slot of an object, or a new slot; False if it takes none."""
    if target is None or not target.is_editable or not hasattr(target.data, "materials"):
        return False
    if not target.material_slots:
        if not target.data.is_editable:
            return False
        target.data.materials.append(new)
        return True
    if not target.data.is_editable:
        target.material_slots[target.active_material_index].link = "OBJECT"
    target.active_material = new
    return True


def _menu_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator(NFM_OT_import_measurement.bl_idname, text="Measured BRDF (.binary)")


_register_classes, _unregister_classes = register_classes_factory((NFM_OT_import_measurement,))


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_file_import.append(_menu_entry)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu_entry)
    _unregister_classes()
