# SPDX-License-Identifier: GPL-3.0-or-later
"""Bring the shaders of all measured materials up to date now."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.utils import register_classes_factory

from .. import live


class NFM_OT_apply_edits(bpy.types.Operator):
    """bpy.ops.nfm.apply_edits()."""

    bl_idname = "nfm.apply_edits"
    bl_label = "Apply Edits"
    bl_description = (
        "Bring the shaders of all measured materials up to date now. A window does so by itself "
        "soon after an edit, and every render before it starts"
    )
    bl_options = {"REGISTER"}

    def execute(self, _context: bpy.types.Context) -> set[str]:
        changed = live.flush()
        self.report({"INFO"}, rpt_("Materials brought up to date: {:d}").format(len(changed)))
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_apply_edits,))
