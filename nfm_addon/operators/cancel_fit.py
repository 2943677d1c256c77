# SPDX-License-Identifier: GPL-3.0-or-later
"""Cancel the running fit, or all."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty
from bpy.utils import register_classes_factory

from ..fitting.queue import queue


class NFM_OT_cancel_fit(bpy.types.Operator):
    """bpy.ops.nfm.cancel_fit(all=False)."""

    bl_idname = "nfm.cancel_fit"
    bl_label = "Cancel Fit"
    bl_description = "Stop the running fit and remove its draft; Esc does the same"

    all: BoolProperty(name="All", description="Also those that wait", options={"SKIP_SAVE"})

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        if queue.jobs:
            return True
        cls.poll_message_set("No fit is running")
        return False

    def execute(self, _context: bpy.types.Context) -> set[str]:
        for job in list(queue.jobs) if self.all else queue.jobs[:1]:
            queue.cancel(job)
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_cancel_fit,))
