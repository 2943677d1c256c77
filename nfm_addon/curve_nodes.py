# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors as curve widgets: nodes inside a material's node group, which draw and keep curves.

Nothing flows through them. They are nodes because nothing else in Blender can have a curve widget
that is saved, undone and copied with its material.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import bpy
import numpy as np

from ..fitter.editing import curves
from ..fitter.editing.curves import (
    AROUND_CURVES,
    CURVES,
    FRESNEL_CURVES,
    MASKING_AROUND_CURVES,
    MASKING_CURVES,
    NDF_AROUND_CURVES,
    NDF_CURVES,
)
from ..fitter.editing.edit_document import Handle, Handles

FRAME = "Curves"
FRESNEL_NODE = FRESNEL_CURVES[0]

# Of the curves in an RGB Curves node the combined one is the last.
_RGB_INDEX = dict(zip(FRESNEL_CURVES, (3, 0, 1, 2), strict=True))

# Sharp bends between handles would show as bands; a smooth curve must not overshoot its handles.
KIND = "AUTO_CLAMPED"

_LABELS = {
    **{name: f"{name}: highlight shape" for name in NDF_CURVES},
    **{name: f"{name}: falloff to grazing" for name in MASKING_CURVES},
    **{name: f"{name}, 0 to 360 degrees" for name in AROUND_CURVES},
    FRESNEL_NODE: "F: colour from facing to grazing",
}


# Rows of nodes in the frame, from its top.
_ROWS = (NDF_CURVES, MASKING_CURVES, (FRESNEL_NODE,), NDF_AROUND_CURVES, MASKING_AROUND_CURVES)


def ensure(group: bpy.types.ShaderNodeTree, names: Sequence[str]) -> None:
    """Add the nodes of curves that a group does not have, in a frame below its other nodes."""
    frame = group.nodes.get(FRAME)
    if frame is None:
        frame = group.nodes.new("NodeFrame")
        frame.name = frame.label = FRAME
    for row, family in enumerate(_ROWS):
        for column, name in enumerate(family):
            if name not in names or name in group.nodes:
                continue
            rgb = name == FRESNEL_NODE
            node = group.nodes.new("ShaderNodeRGBCurve" if rgb else "ShaderNodeFloatCurve")
            node.name, node.label = name, _LABELS[name]
            node.width = 260
            node.parent = frame
            node.location = (300 * column - 300, -420 - 380 * row)
            for socket in (*node.inputs, *node.outputs):
                socket.hide = True


def node_of(group: bpy.types.ShaderNodeTree, name: str) -> bpy.types.ShaderNode | None:
    """The node that shows a curve, or None if it was removed."""
    return group.nodes.get(FRESNEL_NODE if name in FRESNEL_CURVES else name)


def draw(group: bpy.types.ShaderNodeTree, heights: Mapping[str, np.ndarray]) -> None:
    """Draw curves through heights (90,) by name, with a few handles each."""
    for name, values in heights.items():
        curve = _curve(group, name)
        if curve is None:
            continue

        def evaluate(handles: np.ndarray, places: np.ndarray, name: str = name) -> np.ndarray:
            set_handles(group, name, [(x, y, KIND) for x, y in handles.tolist()])
            return _heights(*_mapping_and_curve(group, name), places)

        handles = curves.place_handles(curves.positions(name), values, evaluate)
        set_handles(group, name, [(x, y, KIND) for x, y in handles.tolist()])


def handles(group: bpy.types.ShaderNodeTree) -> Handles:
    """The handles of all curves that are there, by name."""
    found = {}
    for name in CURVES:
        curve = _curve(group, name)
        if curve is not None:
            found[name] = tuple(_handle(point) for point in curve.points)
    return found


def set_handles(group: bpy.types.ShaderNodeTree, name: str, wanted: Sequence[Handle]) -> None:
    """Give a curve these handles, at least two."""
    mapping, curve = _mapping_and_curve(group, name)
    points = curve.points
    while len(points) > len(wanted):
        points.remove(points[-2])
    while len(points) < len(wanted):
        points.new(0.5, 0.5)
    for point, (x, y, kind) in zip(points, wanted, strict=True):
        point.location = (x, y)
        point.handle_type = kind
    mapping.update()


def write(group: bpy.types.ShaderNodeTree, wanted: Handles) -> None:
    """Give curves by name these handles; those that were removed are left out."""
    for name, points in wanted.items():
        if node_of(group, name) is not None:
            set_handles(group, name, points)


def join_seams(group: bpy.types.ShaderNodeTree) -> None:
    """Have curves around begin and end at one height, as 0 and 360 degrees are one azimuth.

    The end that was moved takes the other one with it.
    """
    before = json.loads(group.nfm.seams or "{}")
    after = {}
    for name in AROUND_CURVES:
        curve = _curve(group, name)
        if curve is None:
            continue
        first, last = curve.points[0], curve.points[-1]
        heights = first.location.y, last.location.y
        known = before.get(name, heights[0])
        after[name] = max(heights, key=lambda height, known=known: abs(height - known))
        if heights[0] != heights[1]:
            for point in (first, last):
                point.location.y = after[name]
            node_of(group, name).mapping.update()
    if after != before:
        group.nfm.seams = json.dumps(after)


def heights(group: bpy.types.ShaderNodeTree) -> dict[str, np.ndarray]:
    """The heights (90,) of all curves that are there, by name, as the widgets interpolate."""
    found = {}
    for name in CURVES:
        if node_of(group, name) is not None:
            mapping, curve = _mapping_and_curve(group, name)
            mapping.update()  # a script may have moved handles without
            found[name] = _heights(mapping, curve, curves.positions(name))
    return found


def _heights(
    mapping: bpy.types.CurveMapping, curve: bpy.types.CurveMap, places: np.ndarray
) -> np.ndarray:
    return np.array([mapping.evaluate(curve, place) for place in places.tolist()])


def _handle(point: bpy.types.CurveMapPoint) -> Handle:
    x, y = point.location
    return x, y, point.handle_type


def _curve(group: bpy.types.ShaderNodeTree, name: str) -> bpy.types.CurveMap | None:
    return _mapping_and_curve(group, name)[1] if node_of(group, name) else None


def _mapping_and_curve(
    group: bpy.types.ShaderNodeTree, name: str
) -> tuple[bpy.types.CurveMapping, bpy.types.CurveMap]:
    mapping = node_of(group, name).mapping
    return mapping, mapping.curves[_RGB_INDEX.get(name, 0)]
