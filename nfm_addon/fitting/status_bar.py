# SPDX-License-Identifier: GPL-3.0-or-later
"""The status bar while fits run: which file, the step, a bar, the time left, a button to cancel."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .queue import Job, queue


def text_of(job: Job, waiting: int) -> str:
    """One line about the running job and how many wait."""
    parts = [iface_("{:s}: {:s}").format(job.name, job.step)]
    left = job.seconds_left()
    if left is not None:
        parts.append(iface_("{:.0f} s left").format(max(left, 1)))
    if waiting:
        parts.append(iface_("{:d} waiting").format(waiting))
    return ", ".join(parts)


def redraw() -> None:
    """Have the status bar of every window drawn again."""
    for window in bpy.context.window_manager.windows:
        # the only way from Python to the areas that belong to no screen
        window.workspace.status_text_set_internal(None)


def _draw(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    if not queue.jobs:
        return
    job, *waiting = queue.jobs
    row = header.layout.row(align=True)
    bar = row.row()
    bar.ui_units_x = 18
    bar.progress(text=text_of(job, len(waiting)), factor=job.progress)
    row.operator("nfm.cancel_fit", text="", icon="X")


def register() -> None:
    bpy.types.STATUSBAR_HT_header.prepend(_draw)


def unregister() -> None:
    bpy.types.STATUSBAR_HT_header.remove(_draw)
