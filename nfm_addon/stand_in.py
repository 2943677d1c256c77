# SPDX-License-Identifier: GPL-3.0-or-later
"""What EEVEE and Workbench show of a material, and Cycles where it has no OSL.

Inside the node group, beside the Script node: a Diffuse and three Glossy nodes whose colours follow
the view angle, driven by the group's own sockets, with an output of their own.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..fitter.models.factors import Factors
from ..fitter.shading.stand_in import StandIn, stand_in
from . import live_nodes

OUTPUT = "Stand-in"
FRAME = "NFM Stand-in"
LARGEST_COLOR = 1e6  # curves may ask for what single precision cannot hold
ABOVE = 1200  # where the nodes begin, over the Script node; the curves are under it


def put(group: bpy.types.ShaderNodeTree, model: Factors) -> StandIn:
    """Make the stand-in follow a model; its nodes are made if the group has none."""
    values = stand_in(model)
    if FRAME not in group.nodes:
        _make_nodes(group, len(values.alpha))
    for lobe, (alpha, colors) in enumerate(zip(values.alpha, values.colors, strict=True), 1):
        roughness = group.nodes[_name("Glossy", lobe)].inputs["Roughness"]
        if roughness.default_value != np.float32(np.sqrt(alpha)):
            roughness.default_value = float(np.sqrt(alpha))
        _fill_ramp(group.nodes[_name("Colour", lobe)].color_ramp, values.cosines, colors)
    return values


def show_in_workbench(material: bpy.types.Material, values: StandIn) -> None:
    """Set the viewport display: the colour at 48 degrees, the roughness of the strongest lobe."""
    lobes = values.albedo[:, 3]
    total = values.diffuse + lobes.sum(0)
    strongest = int(lobes.sum(1).argmax())
    material.diffuse_color = (*np.clip(total, 0, 1), 1.0)
    material.roughness = float(np.sqrt(values.alpha[strongest]))
    material.metallic = float(lobes.sum() / max(total.sum(), 1e-9))


def _name(kind: str, lobe: int) -> str:
    return f"NFM Stand-in {kind} {lobe}"


def _make_nodes(group: bpy.types.ShaderNodeTree, n_lobes: int) -> None:
    group.interface.new_socket(OUTPUT, in_out="OUTPUT", socket_type="NodeSocketShader")
    links = group.links
    frame = group.nodes.new("NodeFrame")
    frame.name = frame.label = FRAME
    entry = next(node for node in group.nodes if node.type == "GROUP_INPUT")
    exit_ = next(node for node in group.nodes if node.type == "GROUP_OUTPUT")

    def new(kind: str, name: str, column: int, row: int) -> bpy.types.Node:
        node = group.nodes.new(kind)
        node.name = name
        node.parent = frame
        node.location = (-400 + 240 * column, ABOVE - 240 * row)
        return node

    facing = new("ShaderNodeLayerWeight", "NFM Stand-in Facing", 0, 0)
    facing.inputs["Blend"].default_value = 0.5  # makes Facing 1 - cos
    total = new("ShaderNodeBsdfDiffuse", "NFM Stand-in Diffuse", 2, 0)
    live_nodes.link_diffuse(group, entry.outputs["Diffuse"], total.inputs["Color"])
    links.new(entry.outputs["Normal"], facing.inputs["Normal"])
    links.new(entry.outputs["Normal"], total.inputs["Normal"])
    total = total.outputs["BSDF"]
    for lobe in range(1, n_lobes + 1):
        ramp = new("ShaderNodeValToRGB", _name("Colour", lobe), 0, lobe)
        links.new(facing.outputs["Facing"], ramp.inputs["Fac"])
        scaled = new("ShaderNodeVectorMath", _name("Scale", lobe), 1, lobe)
        scaled.operation = "MULTIPLY"
        links.new(ramp.outputs["Color"], scaled.inputs[0])
        source = entry.outputs[f"Lobe {lobe} Scale"]
        live_nodes.link_scale(group, lobe - 1, source, scaled.inputs[1])
        glossy = new("ShaderNodeBsdfAnisotropic", _name("Glossy", lobe), 2, lobe)
        glossy.distribution = "GGX"
        links.new(scaled.outputs["Vector"], glossy.inputs["Color"])
        links.new(entry.outputs["Normal"], glossy.inputs["Normal"])
        add = new("ShaderNodeAddShader", _name("Sum", lobe), 3, lobe)
        links.new(total, add.inputs[0])
        links.new(glossy.outputs["BSDF"], add.inputs[1])
        total = add.outputs["Shader"]
    links.new(total, exit_.inputs[OUTPUT])


def _fill_ramp(ramp: bpy.types.ColorRamp, cosines: np.ndarray, colors: np.ndarray) -> None:
    """Write a ramp, of which only what is new: each number written updates the whole tree."""
    elements = ramp.elements
    positions = np.float32(1 - cosines).tolist()
    if [element.position for element in elements] != positions:
        while len(elements) > len(colors):
            elements.remove(elements[-1])
        while len(elements) < len(colors):
            elements.new(1.0)
        # they rise, and setting one never moves it past its neighbours if all start at the end
        for element in elements:
            element.position = 1.0
        for element, position in zip(elements, positions, strict=True):
            element.position = position
    shown = np.float32(np.minimum(colors, LARGEST_COLOR)).tolist()
    for element, color in zip(elements, shown, strict=True):
        if tuple(element.color) != (*color, 1.0):
            element.color = (*color, 1.0)
