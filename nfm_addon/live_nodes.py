# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits that the shader takes as inputs: nodes between a group's sockets and its Script node.

They cost no new shader: the gain of each lobe multiplies its scale, and the diffuse colour goes
through an affine map. At 1 and at the identity they change no bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy
import numpy as np

from ..fitter.models.factors import N_LOBES

FRAME = "Sliders"
GAINS = tuple(f"Lobe {lobe + 1} Gain" for lobe in range(N_LOBES))
ROWS = ("Diffuse Red", "Diffuse Green", "Diffuse Blue")
OFFSET = "Diffuse Offset"


def add(group: bpy.types.ShaderNodeTree) -> None:
    """Add the nodes, neutral, in a frame left of the Script node."""
    frame = group.nodes.new("NodeFrame")
    frame.name = frame.label = FRAME
    for number, name in enumerate(GAINS):
        node = _vector_math(group, frame, name, "MULTIPLY", (-420, -120 - 60 * number))
        node.inputs[1].default_value = (1, 1, 1)
    for number, (name, row) in enumerate(zip(ROWS, np.eye(3).tolist(), strict=True)):
        node = _vector_math(group, frame, name, "DOT_PRODUCT", (-600, 60 - 60 * number))
        node.inputs[1].default_value = row
    combine = group.nodes.new("ShaderNodeCombineXYZ")
    combine.parent, combine.location, combine.hide = frame, (-420, 60), True
    offset = _vector_math(group, frame, OFFSET, "ADD", (-240, 60))
    for name, socket in zip(ROWS, combine.inputs, strict=True):
        group.links.new(group.nodes[name].outputs["Value"], socket)
    group.links.new(combine.outputs["Vector"], offset.inputs[0])


def link_diffuse(
    group: bpy.types.ShaderNodeTree, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket
) -> None:
    """Lead a colour through the diffuse map."""
    for name in ROWS:
        group.links.new(source, group.nodes[name].inputs[0])
    group.links.new(group.nodes[OFFSET].outputs["Vector"], target)


def link_scale(
    group: bpy.types.ShaderNodeTree,
    lobe: int,
    source: bpy.types.NodeSocket,
    target: bpy.types.NodeSocket,
) -> None:
    """Lead a lobe's scale through its gain."""
    gain = group.nodes[GAINS[lobe]]
    group.links.new(source, gain.inputs[0])
    group.links.new(gain.outputs["Vector"], target)


def inputs(
    gains: tuple[float, ...], matrix: np.ndarray, offset: np.ndarray
) -> dict[str, Sequence[float]]:
    """What the nodes hold, by name, for the gains of the lobes and the map of the diffuse colour.

    Diffuse colour = matrix (3, 3) times that of the socket, plus offset (3,).
    """
    wanted = dict(zip(GAINS, ((gain,) * 3 for gain in gains), strict=True))
    return wanted | dict(zip(ROWS, matrix.tolist(), strict=True)) | {OFFSET: offset.tolist()}


def differ(group: bpy.types.ShaderNodeTree, wanted: Mapping[str, Sequence[float]]) -> bool:
    """Whether the nodes that are there hold something else; an artist may have removed some."""
    return any(_differs(group, name, value) for name, value in wanted.items())


def write(group: bpy.types.ShaderNodeTree, wanted: Mapping[str, Sequence[float]]) -> None:
    """Have the nodes that are there hold `inputs`."""
    for name, value in wanted.items():
        # what is written is an update, even if nothing changes, and Cycles starts anew
        if _differs(group, name, value):
            group.nodes[name].inputs[1].default_value = value


def _differs(group: bpy.types.ShaderNodeTree, name: str, value: Sequence[float]) -> bool:
    node = group.nodes.get(name)
    return bool(node) and not np.array_equal(
        np.float32(node.inputs[1].default_value), np.float32(value)
    )


def _vector_math(
    group: bpy.types.ShaderNodeTree,
    frame: bpy.types.NodeFrame,
    name: str,
    operation: str,
    location: tuple[float, float],
) -> bpy.types.ShaderNodeVectorMath:
    node = group.nodes.new("ShaderNodeVectorMath")
    node.name = node.label = name
    node.operation = operation
    node.parent, node.location, node.hide = frame, location, True
    return node
