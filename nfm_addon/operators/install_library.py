# SPDX-License-Identifier: GPL-3.0-or-later
"""Install the material library as an asset library, and remove it."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.utils import register_classes_factory

from ...fitter.errors import NfmError
from ...fitter.jobs.library import ENTRIES
from .. import material_library


class NFM_OT_install_library(bpy.types.Operator):
    """bpy.ops.nfm.install_library()."""

    bl_idname = "nfm.install_library"
    bl_label = "Install Material Library"
    bl_description = (
        "Make the materials that come with the add-on in its own folder and show them in the asset "
        "browser, from where they can be dropped onto objects. Nothing is downloaded; Esc cancels"
    )
    bl_options = {"REGISTER"}

    _timer = None
    _steps: Iterator[tuple[int, int]] | None = None

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        if bpy.app.background or not context.window:
            return self.execute(context)
        self._steps = material_library.install()
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.progress_begin(0, len(ENTRIES))
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            self._end(context)
            self.report({"INFO"}, rpt_("Cancelled; the next time goes on from the beginning"))
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            done, total = next(self._steps)
        except StopIteration:
            return self._finish(context)
        except NfmError as error:
            self._end(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.progress_update(done)
        text = rpt_("Installing the material library: {:d} of {:d}").format(done, total)
        context.workspace.status_text_set(text)
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """The window was closed."""
        self._end(context)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        try:
            for _ in material_library.install():
                pass
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._tell()
        return {"FINISHED"}

    def _finish(self, context: bpy.types.Context) -> set[str]:
        self._end(context)
        for window in context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()
                if area.type == "FILE_BROWSER" and area.ui_type == "ASSETS":
                    with context.temp_override(window=window, area=area):
                        bpy.ops.asset.library_refresh()
        self._tell()
        return {"FINISHED"}

    def _tell(self) -> None:
        text = rpt_("{:d} materials are in the asset browser, library {!r}")
        self.report({"INFO"}, text.format(len(ENTRIES), material_library.NAME))

    def _end(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class NFM_OT_remove_library(bpy.types.Operator):
    """bpy.ops.nfm.remove_library()."""

    bl_idname = "nfm.remove_library"
    bl_label = "Remove Material Library"
    bl_description = (
        "Take the material library out of the asset browser and delete its files. Materials that "
        "were appended from it stay; linked ones are lost"
    )
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if material_library.registered() or material_library.installed_folder().is_dir():
            return True
        cls.poll_message_set("The library is not installed")
        return False

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context: bpy.types.Context) -> set[str]:
        try:
            material_library.remove()
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


def _menu_entry(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    if not material_library.registered():
        menu.layout.separator()
        menu.layout.operator(NFM_OT_install_library.bl_idname, icon="MATERIAL")


_register_classes, _unregister_classes = register_classes_factory(
    (NFM_OT_install_library, NFM_OT_remove_library)
)


# Blender has unregistered its own menus when it unregisters add-ons at its end.
_menu: type[bpy.types.Menu] | None = None


def register() -> None:
    global _menu
    _register_classes()
    _menu = bpy.types.ASSETBROWSER_MT_asset
    _menu.append(_menu_entry)


def unregister() -> None:
    _menu.remove(_menu_entry)
    _unregister_classes()
