# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader of a material as it is edited.

It is made in two stages. While a person drags, the closures of the last base are kept, which is
quick; once they rest, and for every render, everything is as a fresh import would make it.
"""

from __future__ import annotations

import json

import bpy
import numpy as np

from ...fitter.shading.closures import Closure
from .. import curve_nodes, live_nodes, script_node, stand_in
from ..node_group import SCRIPT_NODE
from ..shader_source import Surface, new_surface
from .edited_model import diffuse_map, shader_model
from .own_nodes import group_of, own_group
from .state import state_of

_DRAFT = " draft"

# The closures of each group's last base, by the group's number in this session. Lost when Blender
# ends, which costs the next edit their selection.
_closures: dict[int, tuple[Closure, ...]] = {}


def refresh(
    owner: bpy.types.Material,
    settings: bpy.types.PropertyGroup | None = None,
    *,
    draft: bool = False,
) -> bool:
    """Make the shader what the material asks for; whether there was something to do.

    settings : with the values of a frame; None is owner.nfm
    draft : with the closures of the last base, fewer views of anisotropic models, and without
        the error

    Raises
    ------
    ParameterFileError
        The stored parameters were damaged.
    ShaderError
        This Blender cannot compile the shader, or the material has lost its Script node or is
        linked.
    """
    group = group_of(owner)
    curve_nodes.join_seams(group)
    state = state_of(owner, settings)
    digest = state.digest()
    changed = group.nfm.applied != digest
    if changed and not (draft and group.nfm.applied == digest + _DRAFT):
        group = own_group(owner)
        model = shader_model(state, curve_nodes.heights(group))
        closures = _closures.get(group.session_uid) if draft else None
        sampling = state.settings.sampling.lower()
        surface = new_surface(model, sampling, closures, draft=draft)
        script_node.fill(group.nodes[SCRIPT_NODE], f"{owner.name}.osl", surface.source)
        _remember(owner, group, surface, digest + (_DRAFT if draft else ""))
        stand_in.show_in_workbench(owner, stand_in.put(group, model))
    else:
        changed = False
    gains = tuple(lobe.gain for lobe in state.sliders.lobes)
    wanted = live_nodes.inputs(gains, *diffuse_map(state))
    if not live_nodes.differ(group, wanted):
        return changed
    live_nodes.write(own_group(owner), wanted)
    return True


def adopt(owner: bpy.types.Material, surface: Surface) -> None:
    """Note that a surface, just made, is the one that the material asks for."""
    _remember(owner, group_of(owner), surface, state_of(owner).digest())


def is_drafted(owner: bpy.types.Material) -> bool:
    """Whether the shader shows what the material asks for, if only as a draft."""
    digest = state_of(owner).digest()
    return group_of(owner).nfm.applied in (digest, digest + _DRAFT)


def give_up(owner: bpy.types.Material, settings: bpy.types.PropertyGroup | None = None) -> None:
    """Note that the shader for the present state cannot be made, and leave it as it is."""
    group_of(owner).nfm.applied = state_of(owner, settings).digest()


def _remember(
    owner: bpy.types.Material, group: bpy.types.ShaderNodeTree, surface: Surface, applied: str
) -> None:
    group.nfm.applied = applied
    if surface.error:
        figures = surface.error.figures()
        owner.nfm.native_error = figures["native_error"]
        owner.nfm.native_psnr = figures["native_psnr"]
        owner.nfm.native_share = max(1 - figures["native_directional_error"], 0.0)
    owner.nfm.edit.albedo = json.dumps(np.round(surface.albedo, 5).tolist())
    owner.update_tag()  # or undo would not take back what was written here
    if surface.closures:
        _closures[group.session_uid] = surface.closures
