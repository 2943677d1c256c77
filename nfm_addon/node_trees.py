# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials, worlds and lamps, alike in all supported versions of Blender."""

import bpy


def empty_tree(
    owner: bpy.types.Material | bpy.types.World | bpy.types.Light,
) -> bpy.types.NodeTree:
    """The owner's node tree without nodes."""
    # a lamp may have none, before Blender 5.0 neither have new materials and worlds
    if owner.node_tree is None:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree
