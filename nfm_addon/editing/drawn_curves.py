# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves of a material as they were drawn from its measurement, and as they are now.

material.nfm.edit.drawn keeps handles and heights of the first drawing: an edit is what has changed
since.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import bpy
import numpy as np

from ...fitter.editing import edits
from ...fitter.editing.curves import CURVES, CURVES_OF, Heights
from ...fitter.editing.edit_document import Handles
from .. import curve_nodes
from ..node_group import kind_of
from .own_nodes import group_of, own_group
from .state import State


def draw_curves(owner: bpy.types.Material, handles: Handles | None = None) -> None:
    """Draw the curves of a material from its measurement; what was edited by hand is gone.

    handles : of curves that were drawn before, to have the same again
    """
    group = group_of(owner)
    model = State(owner.nfm, {}).measured
    curve_nodes.ensure(group, CURVES_OF[model.kind])
    curve_nodes.draw(group, edits.drawn(model))
    curve_nodes.write(group, handles or {})
    curve_nodes.join_seams(group)
    heights = {name: values.tolist() for name, values in curve_nodes.heights(group).items()}
    drawn = {"handles": curve_nodes.handles(group), "heights": heights}
    owner.nfm.edit.drawn = json.dumps(drawn)


def drawn_handles(owner: bpy.types.Material) -> Handles:
    """The handles of the curves as they were drawn from the measurement."""
    if not owner.nfm.edit.drawn:
        return {}
    stored = json.loads(owner.nfm.edit.drawn)["handles"]
    return {name: tuple(map(tuple, handles)) for name, handles in stored.items()}


def reset_curves(owner: bpy.types.Material, names: Sequence[str] = CURVES) -> None:
    """Draw curves as they were drawn from the measurement, those that were removed as well.

    names : those that the material does not have are left out

    Raises
    ------
    ParameterFileError, ShaderError
        As refresh.
    """
    group = own_group(owner)
    present = curve_nodes.handles(group)
    missing = set(CURVES_OF[kind_of(group)]) - set(present)
    if missing or missing - set(drawn_handles(owner)):
        draw_curves(owner, drawn_handles(owner))
        curve_nodes.write(group, {name: present[name] for name in present if name not in names})
    drawn = drawn_handles(owner)
    curve_nodes.write(group, {name: drawn[name] for name in names if name in drawn})


def before_and_after(state: State, heights: Heights) -> tuple[Heights, Heights]:
    """Heights of the edited curves, as drawn and now; those that were removed are not edited.

    heights : of the curves now
    """
    drawn = state.settings.edit.drawn
    if not drawn:
        return {}, {}
    stored = json.loads(drawn)
    # handles decide: heights may differ in the last digit between versions of Blender
    edited = [
        name
        for name, handles in stored["handles"].items()
        if name in heights and [list(handle) for handle in state.handles[name]] != handles
    ]
    before = {name: np.array(stored["heights"][name]) for name in edited}
    return before, {name: heights[name] for name in edited}
