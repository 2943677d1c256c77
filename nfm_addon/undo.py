# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo steps for changes that no operator makes, such as those of a finished fit."""

import bpy


def push(message: str) -> None:
    """Make an undo step of what has changed; in the background there is nobody to undo it."""
    if bpy.app.background:
        return
    # a timer has no window, and the operator wants one
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_push(message=message)
