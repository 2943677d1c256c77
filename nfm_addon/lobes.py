# SPDX-License-Identifier: GPL-3.0-or-later
"""Mute and solo of lobes: a node right behind the group's input makes a scale black.

The scale itself is not touched, so whatever is typed, linked or keyframed there is heard again when
the node is gone.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy


def audible(mute: Sequence[bool], solo: Sequence[bool]) -> list[bool]:
    """Which lobes are shown: those on solo if any is, else those that are not muted."""
    return list(solo) if any(solo) else [not muted for muted in mute]


def show(group: bpy.types.ShaderNodeTree, shown: Sequence[bool]) -> None:
    """Show these lobes of a material's node group and no others."""
    entry = next(node for node in group.nodes if node.type == "GROUP_INPUT")
    for lobe, is_shown in enumerate(shown, 1):
        name = f"NFM Mute {lobe}"
        gate = group.nodes.get(name)
        source = entry.outputs[f"Lobe {lobe} Scale"]
        if is_shown and gate:
            _feed(group, gate.outputs["Vector"], source)
            group.nodes.remove(gate)
        elif not is_shown and not gate:
            gate = group.nodes.new("ShaderNodeVectorMath")
            gate.name = gate.label = name
            gate.operation = "MULTIPLY"
            gate.inputs[1].default_value = (0, 0, 0)
            gate.location = (entry.location.x + 20, entry.location.y + 60 * lobe)
            gate.hide = True
            _feed(group, source, gate.outputs["Vector"])
            group.links.new(source, gate.inputs[0])


def _feed(
    group: bpy.types.ShaderNodeTree, old: bpy.types.NodeSocket, new: bpy.types.NodeSocket
) -> None:
    """Have everything that `old` feeds be fed by `new`."""
    for link in list(old.links):
        group.links.new(new, link.to_socket)
