# SPDX-License-Identifier: GPL-3.0-or-later
"""A material as numbers, with all that decides how it is rendered."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...fitter.models.factors import Factors
from .. import lobes
from ..node_group import LOBE_SOCKETS, find_group_node
from .edited_model import diffuse_map, edited_model, socket_color
from .state import state_of


def linked_colors(owner: bpy.types.Material) -> list[str]:
    """Names of the colour sockets of a material's node that other nodes drive.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    sockets = find_group_node(owner).inputs
    return [name for name in ("Diffuse", *LOBE_SOCKETS) if sockets[name].is_linked]


def rendered_model(owner: bpy.types.Material) -> Factors:
    """The model with curves, sliders and blend, the colours typed into the node, mute and solo.

    A linked socket has no one colour: it counts as left alone.

    Raises
    ------
    ParameterFileError, ShaderError
        As refresh.
    """
    model = edited_model(owner)
    sockets, linked = find_group_node(owner).inputs, linked_colors(owner)
    heard = lobes.audible(owner.nfm.mute, owner.nfm.solo)
    tints = [np.ones(3) if name in linked else socket_color(sockets[name]) for name in LOBE_SOCKETS]
    scale = model.scale * np.array(tints) * np.array(heard)[:, None]
    if "Diffuse" in linked:
        return replace(model, scale=scale)
    matrix, offset = diffuse_map(state_of(owner))
    albedo = matrix @ socket_color(sockets["Diffuse"]) + offset
    return replace(model, scale=scale, diffuse=np.maximum(albedo, 0) / np.pi)
