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
    """Whether a material can be changed: it is not linked, and has, or can have, its own group.

    A library override has the linked group until `own_group` copies it.
    """
    try:
        group_of(owner)
    except ShaderError:
        return False
    return owner.library is None


def own_group(owner: bpy.types.Material) -> bpy.types.ShaderNodeTree:
    """The node group of a material, which gets a copy where others have the same.

    Of a library override that copy is in this file, and the override keeps it.

    Raises
    ------
    ShaderError
        The material is linked from another file.
    """
    node = find_group_node(owner)
    group = node.node_tree
    if owner.library:
        raise ShaderError(
            f"material {owner.name!r} is linked from another file; make a library override first"
        )
    if group.override_library:  # a copy of it would be an override again, whose nodes are fixed
        group = node.node_tree = group.override_library.reference.copy()
    elif group.library or any(
        other != owner and _has_group(other, group) for other in measured_materials()
    ):
        group = node.node_tree = group.copy()
    return group


def _has_group(other: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> bool:
    try:
        return group_of(other) == group
    except ShaderError:
        return False
