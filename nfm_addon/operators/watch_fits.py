# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs beside the fits: redraws their progress, reports what they say, and listens for Esc."""

from __future__ import annotations

import bpy
from bpy.utils import register_classes_factory

from ..fitting import status_bar
from ..fitting.queue import INTERVAL, queue


class NFM_OT_watch_fits(bpy.types.Operator):
    """bpy.ops.nfm.watch_fits('INVOKE_DEFAULT'); import and refit start it."""

    bl_idname = "nfm.watch_fits"
    bl_label = "Watch Fits"
    bl_description = "Show the progress of running fits in the status bar; Esc cancels the first"
    bl_options = {"INTERNAL"}

    _timer = None
    _shown = ""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if context.window and not bpy.app.background:
            return True
        cls.poll_message_set("There is no window")
        return False

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        windows = context.window_manager.windows
        running = (operator.bl_idname for w in windows for operator in w.modal_operators)
        if "NFM_OT_watch_fits" in running:
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(INTERVAL, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        while queue.messages:
            level, text = queue.messages.popleft()
            self.report({level}, text)
        if not queue.jobs:
            self.cancel(context)
            status_bar.redraw()
            return {"FINISHED"}
        if event.type == "ESC" and event.value == "PRESS" and not _in_file_browser(context, event):
            queue.cancel(queue.jobs[0])
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            job, *waiting = queue.jobs
            shown = f"{job.progress:.2f} {status_bar.text_of(job, len(waiting))}"
            if shown != self._shown:
                self._shown = shown
                status_bar.redraw()
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)


def _in_file_browser(context: bpy.types.Context, event: bpy.types.Event) -> bool:
    """Whether Esc is meant for a file browser, which opens over the window or in one of its own."""
    return any(
        area.type == "FILE_BROWSER" and area.spaces.active.active_operator
        for area in context.screen.areas
    )


register, unregister = register_classes_factory((NFM_OT_watch_fits,))
