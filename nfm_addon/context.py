# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured material that an operator is meant for."""

from __future__ import annotations

import bpy


def measured_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The material of the panel, or that of the active object, if it is one of ours."""
    item = getattr(context, "material", None)
    if item is None and context.object:
        item = context.object.active_material
    return item if item and item.nfm.parameters else None


class NeedsMaterial:
    """Operators that work on a measured material."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        item = measured_material(context)
        if item is None:
            cls.poll_message_set("The active material is not a measured one")
            return False
        if not item.is_editable:
            cls.poll_message_set("The material is linked; make it local or override it")
            return False
        return True
