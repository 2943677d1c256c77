# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group of a measured material: what is in it, and where to find it again.

Diffuse, Lobe 1-3 Scale -> sliders -> Script node -> BSDF        curves: not linked
Normal, Tangent, Rotation -----------^
                                   stand_in.py -> Stand-in
"""

from __future__ import annotations

import bpy
import numpy as np

from ..fitter.models.factors import Factors
from . import live_nodes, stand_in
from .errors import ShaderError

GROUP_NAME = "NFM BRDF"
SCRIPT_NODE = "NFM Shader"

LOBE_SOCKETS = ("Lobe 1 Scale", "Lobe 2 Scale", "Lobe 3 Scale")
WHITE = (1.0, 1.0, 1.0, 1.0)


def new_group(model: Factors) -> bpy.types.ShaderNodeTree:
    """A group with sockets for a model, and a Script node without a script."""
    group = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    interface = group.interface
    interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    diffuse = interface.new_socket("Diffuse", in_out="INPUT", socket_type="NodeSocketColor")
    diffuse.default_value = (*(np.pi * model.diffuse), 1.0)
    diffuse.description = "Colour of the diffuse reflection, as fitted"
    for name in LOBE_SOCKETS:
        scale = interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketColor")
        scale.default_value = WHITE
        scale.description = "Multiplies this specular lobe; white is as measured"
    normal = interface.new_socket("Normal", in_out="INPUT", socket_type="NodeSocketVector")
    normal.hide_value = True
    if model.kind == "anisotropic":
        _add_frame_sockets(interface)

    script = group.nodes.new("ShaderNodeScript")
    script.name = script.label = SCRIPT_NODE
    script.width = 220
    entry = group.nodes.new("NodeGroupInput")
    entry.location = (-820, 0)
    exit_ = group.nodes.new("NodeGroupOutput")
    exit_.location = (320, 0)
    return group


def _add_frame_sockets(interface: bpy.types.NodeTreeInterface) -> None:
    tangent = interface.new_socket("Tangent", in_out="INPUT", socket_type="NodeSocketVector")
    tangent.hide_value = True
    tangent.description = (
        "Direction from which azimuths count; not linked: along U of the active UV map, or around "
        "Z on a mesh without one"
    )
    rotation = interface.new_socket("Rotation", in_out="INPUT", socket_type="NodeSocketFloat")
    rotation.description = "Turns the material counter-clockwise about the normal, degrees"


def add_inner_nodes(group: bpy.types.ShaderNodeTree, model: Factors) -> stand_in.StandIn:
    """Add sliders, stand-in and, if it is compiled, the connections of the Script node."""
    live_nodes.add(group)
    link(group)
    return stand_in.put(group, model)


def link(group: bpy.types.ShaderNodeTree) -> None:
    """Connect the Script node, whose sockets exist only once it is compiled."""
    nodes = {node.bl_idname: node for node in group.nodes}
    entry, exit_ = nodes["NodeGroupInput"], nodes["NodeGroupOutput"]
    script = group.nodes[SCRIPT_NODE]
    if not script.bytecode:
        return
    live_nodes.link_diffuse(group, entry.outputs["Diffuse"], script.inputs["Diffuse"])
    for lobe, name in enumerate(LOBE_SOCKETS):
        live_nodes.link_scale(group, lobe, entry.outputs[name], script.inputs[name])
    group.links.new(entry.outputs["Normal"], script.inputs["Normal"])
    if "Tangent" in script.inputs:
        _link_frame(group, entry, script)
    group.links.new(script.outputs["BSDF"], exit_.inputs["BSDF"])
    for socket in (*script.inputs, *script.outputs):
        socket.hide = not socket.is_linked


def _link_frame(
    group: bpy.types.ShaderNodeTree,
    entry: bpy.types.NodeGroupInput,
    script: bpy.types.ShaderNodeScript,
) -> None:
    """Connect the tangent that an artist gives, and those that stand in where there is none."""
    for name in ("Tangent", "Rotation"):
        group.links.new(entry.outputs[name], script.inputs[name])
    for row, (name, direction) in enumerate(
        (("UV Tangent", "UV_MAP"), ("Radial Tangent", "RADIAL"))
    ):
        node = group.nodes.new("ShaderNodeTangent")
        node.name = node.label = name
        node.direction_type = direction
        node.axis = "Z"
        node.location = (-300, -300 - 160 * row)
        group.links.new(node.outputs["Tangent"], script.inputs[name])


def kind_of(group: bpy.types.ShaderNodeTree) -> str:
    """The kind of model that a group was made for: "isotropic" or "anisotropic"."""
    return "anisotropic" if "Tangent" in group.interface.items_tree else "isotropic"


def find_group_node(material: bpy.types.Material) -> bpy.types.ShaderNodeGroup:
    """The node of a material that holds its Script node's group.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    tree = material.node_tree  # None until Blender 5.0, for a material without nodes
    for node in tree.nodes if tree else ():
        if node.type == "GROUP" and node.node_tree and SCRIPT_NODE in node.node_tree.nodes:
            return node
    raise ShaderError(
        f"material {material.name!r} has no {GROUP_NAME} node any more; import it again"
    )


def find_script_node(material: bpy.types.Material) -> bpy.types.ShaderNodeScript:
    """The Script node of a material.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    return find_group_node(material).node_tree.nodes[SCRIPT_NODE]
