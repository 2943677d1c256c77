# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting a material on objects, and taking it back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Assignment:
    """What `assign` has done to one object; datablocks by session_uid, which undo keeps.

    slot : index of the material slot
    before : the material it had; None for an empty one
    is_new : whether the slot was added
    link : where the slot's material was stored, "DATA" or "OBJECT"
    """

    uid: int
    slot: int
    before: int | None
    is_new: bool
    link: str

    def find_object(self) -> bpy.types.Object | None:
        """The object, if it is still there."""
        return find_by_uid(bpy.data.objects, self.uid)


def targets_of(context: bpy.types.Context) -> list[int]:
    """session_uid of the selected objects; where none is selected, of the active one."""
    selected = context.selected_objects or [context.active_object]
    return [item.session_uid for item in selected if item]


def assign(uid: int, new: bpy.types.Material) -> Assignment | None:
    """Put a material into the active slot of an object, or a new slot; None if it takes none."""
    target = find_by_uid(bpy.data.objects, uid)
    if target is None or not target.is_editable or not hasattr(target.data, "materials"):
        return None
    if not target.material_slots:
        if not target.data.is_editable:
            return None
        target.data.materials.append(new)
        return Assignment(uid, 0, None, True, "DATA")
    index = target.active_material_index
    slot = target.material_slots[index]
    link, before = slot.link, slot.material
    if not target.data.is_editable:
        slot.link = "OBJECT"
    slot.material = new
    return Assignment(uid, index, before and before.session_uid, False, link)


def take_back(done: Assignment, unwanted: Sequence[bpy.types.Material]) -> None:
    """Give the object its material back, unless the slot holds another one by now."""
    target = done.find_object()
    if target is None or done.slot >= len(target.material_slots):
        return
    slot = target.material_slots[done.slot]
    if slot.material not in unwanted:
        return
    if done.is_new and len(target.material_slots) == 1:
        target.data.materials.clear()
        return
    slot.material = done.before and find_by_uid(bpy.data.materials, done.before)
    slot.link = done.link


def find_by_uid(collection: bpy.types.bpy_prop_collection, uid: int) -> bpy.types.ID | None:
    """The datablock with this session_uid."""
    return next((item for item in collection if item.session_uid == uid), None)
