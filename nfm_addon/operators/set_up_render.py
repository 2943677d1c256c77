# SPDX-License-Identifier: GPL-3.0-or-later
"""Have the scene render measured materials."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.utils import register_classes_factory

from ..render_setup import obstacles, set_up


class NFM_OT_set_up_render(bpy.types.Operator):
    """bpy.ops.nfm.set_up_render()."""

    bl_idname = "nfm.set_up_render"
    bl_label = "Set Up Rendering"
    bl_description = (
        "Switch this scene to Cycles with Open Shading Language on a device that runs it, and tell "
        "what was changed"
    )
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(obstacle.remove for obstacle in obstacles(context)):
            return True
        cls.poll_message_set("Nothing is in the way that could be changed here")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        self.report({"INFO"}, rpt_("Changed: {:s}").format("; ".join(set_up(context))))
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_set_up_render,))
