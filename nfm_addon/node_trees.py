# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials and worlds, alike in all supported versions of Blender."""

import bpy


def empty_tree(owner: bpy.types.Material | bpy.types.World) -> bpy.types.NodeTree:
    """The owner's node tree without nodes."""
    if owner.node_tree is None:  # before Blender 5.0, where every material and world has one
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree
