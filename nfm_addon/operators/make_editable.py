# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a material of another file editable in this one, by a library override."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.utils import register_classes_factory

from ...fitter.errors import NfmError
from .. import editing
from .measured_material import MaterialOperator, active_material


class NFM_OT_make_editable(MaterialOperator, bpy.types.Operator):
    """bpy.ops.nfm.make_editable()."""

    bl_idname = "nfm.make_editable"
    bl_label = "Make Editable"
    bl_description = (
        "Make a library override of a linked material, with a node group of its own in this file. "
        "Its sliders, curves and sampling can then be changed here and are saved here; all else "
        "follows the library"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_material(context)
        if material is None:
            cls.poll_message_set("The active material is not a measured BRDF")
            return False
        if not is_fixed(material):
            cls.poll_message_set("The material can be edited already")
            return False
        target = context.object
        if material.library and target and target.library:
            cls.poll_message_set(
                "The object is linked too: make a library override of it first (Object > Library "
                "Override)"
            )
            return False
        return True

    def act(self, context: bpy.types.Context, material: bpy.types.Material) -> str:
        if material.library:
            material = _override(material, context.object)
        elif material.override_library:
            material.override_library.is_system_override = False
        editing.own_group(material)
        return rpt_("{:s} can be edited in this file").format(material.name)


def is_fixed(material: bpy.types.Material) -> bool:
    """Whether a material, or its node group, is another file's."""
    try:
        group = editing.group_of(material)
    except NfmError:
        return False
    return bool(material.library or group.library or group.override_library)


def _override(linked: bpy.types.Material, target: bpy.types.Object | None) -> bpy.types.Material:
    """A library override in place of a linked material, wherever this file uses that.

    Blender overrides only what is linked for itself, and not merely with an object.
    """
    path = bpy.path.abspath(linked.library.filepath)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = [linked.name]
    material = linked.override_create(remap_local_usages=True)
    for slot in target.material_slots if target else ():
        if slot.material == linked:  # stored in a linked mesh
            slot.link = "OBJECT"
            slot.material = material
    return material


register, unregister = register_classes_factory((NFM_OT_make_editable,))
