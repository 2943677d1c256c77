# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group of a measured material, and whose it is."""

from __future__ import annotations

import bpy

from ..errors import ShaderError
from ..node_group import find_group_node, find_script_node


def measured_materials() -> list[bpy.types.Material]:
    """Materials with a model, of this file and of linked ones."""
    return [item for item in bpy.data.materials if item.nfm.parameters]


def group_of(owner: bpy.types.Material) -> bpy.types.ShaderNodeTree:
    """The node group with the shader of a material.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    return find_script_node(owner).id_data


def has_own_nodes(owner: bpy.types.Material) -> bool:
    """Whether there is a node group with a shader in this file, which can be changed."""
    try:
        group = group_of(owner)
    except ShaderError:
        return False
    return not (owner.library or group.library or group.override_library)


def own_group(owner: bpy.types.Material) -> bpy.types.ShaderNodeTree:
    """The node group of a material, which gets a copy where others have the same.

    Raises
    ------
    ShaderError
        The group is linked from another file.
    """
    node = find_group_node(owner)
    group = node.node_tree
    if group.library or group.override_library:
        raise ShaderError(
            f"material {owner.name!r} has a node group from another file; make it local first"
        )
    if any(other != owner and _has_group(other, group) for other in measured_materials()):
        group = node.node_tree = group.copy()
    return group


def _has_group(other: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> bool:
    try:
        return group_of(other) == group
    except ShaderError:
        return False
