# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators on the active measured material have in common."""

from __future__ import annotations

import bpy

from ...fitter.errors import NfmError
from .. import editing, live


def active_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The measured material that a panel shows, or that of the active object."""
    material = getattr(context, "material", None)
    if material is None and context.active_object:
        material = context.active_object.active_material
    return material if material and material.nfm.parameters else None


class OwnMaterialOperator:
    """An operator on the active measured material, which is not linked."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_material(context)
        if material is None:
            cls.poll_message_set("The active material is not a measured BRDF")
            return False
        if not editing.has_own_nodes(material):
            cls.poll_message_set(
                "The material is linked from another file, or has lost its nodes; the panel "
                "Measured BRDF makes a linked one editable"
            )
            return False
        return True


class MaterialOperator(OwnMaterialOperator):
    """Does something with the active measured material.

    A subclass has act(context, material), which returns a message for the user or None.
    """

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            message = self.act(context, active_material(context))
        except NfmError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if message:
            self.report({"INFO"}, message)
        return {"FINISHED"}


class EditOperator(MaterialOperator):
    """Changes the active measured material and brings its shader up to date.

    A subclass has change(context, material), which returns a message for the user or None.
    """

    def act(self, context: bpy.types.Context, material: bpy.types.Material) -> str | None:
        message = self.change(context, material)
        live.show(material)
        return message
