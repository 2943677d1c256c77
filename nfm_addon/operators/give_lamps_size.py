# SPDX-License-Identifier: GPL-3.0-or-later
"""Give every lamp without size a small one, so that all samplings see it."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import FloatProperty
from bpy.utils import register_classes_factory

from ..lamps import give_size, lamps_without_size


class NFM_OT_give_lamps_size(bpy.types.Operator):
    """bpy.ops.nfm.give_lamps_size(radius=0.01)."""

    bl_idname = "nfm.give_lamps_size"
    bl_label = "Give Lamps a Size"
    bl_description = (
        "Give lamps of zero radius (suns: zero angle) of this scene a small one, which reference "
        "and cosine sampling can see"
    )
    bl_options = {"REGISTER", "UNDO"}

    radius: FloatProperty(
        name="Radius",
        description="Radius of the lamps; for suns the angle in radians",
        default=0.01,
        min=1e-4,
        soft_max=1.0,
        unit="LENGTH",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if any(item.data.is_editable for item in lamps_without_size(context.scene)):
            return True
        cls.poll_message_set("No lamp of this scene has a radius of zero, or all are linked")
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        changed = []
        for item in lamps_without_size(context.scene):
            if item.data.is_editable:
                give_size(item.data, self.radius)
                changed.append(item.name)
        self.report({"INFO"}, rpt_("Lamps with a size now: {:s}").format(", ".join(changed)))
        return {"FINISHED"}


register, unregister = register_classes_factory((NFM_OT_give_lamps_size,))
