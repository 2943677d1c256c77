# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader of a material as it is edited.

It is made in two stages. While a person drags, the closures of the last base are kept, which is
quick; once they rest, and for every render, everything is as a fresh import would make it.
"""

from __future__ import annotations

import json

import bpy
import numpy as np

from ...fitter.models.factors import Factors
from ...fitter.shading import closures
from ...fitter.shading.base_lobes import N_CLOSURES
from ...fitter.shading.closures import Closure
from ...fitter.shading.shading import takes_seconds
from ...osl import generate
from .. import curve_nodes, known_shadings, live_nodes, script_node, stand_in
from ..node_group import SCRIPT_NODE
from ..shader_source import Surface, new_surface
from .edited_model import diffuse_map, shader_model
from .own_nodes import group_of, own_group
from .state import state_of

_DRAFT = " draft"


def refresh(
    owner: bpy.types.Material,
    settings: bpy.types.PropertyGroup | None = None,
    *,
    draft: bool = False,
) -> bool:
    """Make the shader what the material asks for; whether there was something to do.

    settings : with the values of a frame; None is owner.nfm
    draft : where the base lobes are not known, with the closures of the last base, fewer views of
        anisotropic models, and without the error

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
        model = shader_model(state, group)
        sampling = state.settings.sampling.lower()
        surface = new_surface(model, sampling, draft=draft, closures=_last_closures(group))
        script_node.fill(group.nodes[SCRIPT_NODE], f"{owner.name}.osl", surface.source)
        _remember(owner, group, surface, digest)
        stand_in.show_in_workbench(owner, stand_in.put(group, model))
    else:
        changed = False
    gains = tuple(lobe.gain for lobe in state.sliders.lobes)
    wanted = live_nodes.inputs(gains, *diffuse_map(state))
    if not live_nodes.differ(group, wanted):
        return changed
    live_nodes.write(own_group(owner), wanted)
    return True


def slow_model(owner: bpy.types.Material) -> Factors | None:
    """The model whose base lobes a finished shader lacks, if it takes seconds to find them."""
    group, state = group_of(owner), state_of(owner)
    has_base = state.settings.sampling.lower() in generate.BASE_SAMPLINGS
    if not has_base or group.nfm.applied == state.digest():
        return None
    model = shader_model(state, group)
    is_slow = takes_seconds(model) and known_shadings.find(model) is None
    return model if is_slow else None


def adopt(owner: bpy.types.Material, surface: Surface) -> None:
    """Note that a surface, just made, is the one that the material asks for, or its draft."""
    _remember(owner, group_of(owner), surface, state_of(owner).digest())


def is_drafted(owner: bpy.types.Material) -> bool:
    """Whether the shader shows what the material asks for, if only as a draft."""
    digest = state_of(owner).digest()
    return group_of(owner).nfm.applied in (digest, digest + _DRAFT)


def give_up(owner: bpy.types.Material, settings: bpy.types.PropertyGroup | None = None) -> None:
    """Note that the shader for the present state cannot be made, and leave it as it is."""
    group_of(owner).nfm.applied = state_of(owner, settings).digest()


def _remember(
    owner: bpy.types.Material, group: bpy.types.ShaderNodeTree, surface: Surface, digest: str
) -> None:
    group.nfm.applied = digest + (_DRAFT if surface.is_draft else "")
    if surface.error:
        figures = surface.error.figures()
        owner.nfm.native_error = figures["native_error"]
        owner.nfm.native_psnr = figures["native_psnr"]
        owner.nfm.native_share = max(1 - figures["native_directional_error"], 0.0)
    owner.nfm.edit.albedo = json.dumps(np.round(surface.albedo, 5).tolist())
    owner.update_tag()  # or undo would not take back what was written here
    if surface.closures:
        group.nfm.closures = closures.dumps(surface.closures)


def _last_closures(group: bpy.types.ShaderNodeTree) -> tuple[Closure, ...]:
    """Of the group's last base; none where there was no base or the text was damaged."""
    try:
        found = closures.loads(group.nfm.closures or "[]")
    except ValueError:
        return ()
    return found if len(found) == N_CLOSURES else ()
