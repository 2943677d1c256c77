# SPDX-License-Identifier: GPL-3.0-or-later
"""The model of a material with its edits, as a whole and as the shader holds it.

The gains of the lobes and the diffuse colour are inputs of the shader, so that they cost nothing;
its tables are those of the model without them.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from dataclasses import replace

import bpy
import numpy as np

from ...fitter.editing import edits
from ...fitter.editing.blend import blend, mix
from ...fitter.editing.edits import Edits
from ...fitter.editing.energy import within_energy
from ...fitter.models.factors import Factors
from .. import curve_nodes
from ..node_group import LOBE_SOCKETS, find_group_node
from .drawn_curves import before_and_after
from .own_nodes import group_of
from .state import State, state_of

MOST_MODELS = 8

# By the digest of their state; those of states that were used last are at the end.
_models: OrderedDict[str, Factors] = OrderedDict()


def edited_model(owner: bpy.types.Material) -> Factors:
    """The model of a material as it is rendered, with all its edits.

    Raises
    ------
    ParameterFileError, ShaderError
        As refresh.
    """
    state = state_of(owner)
    return _with_inputs(shader_model(state, group_of(owner)), state)


def shader_model(state: State, group: bpy.types.ShaderNodeTree) -> Factors:
    """The model that the shader's tables hold: without what are inputs.

    group : of the material, with its curves as they are in the state. Of a state seen before, the
        model is the same object: it is asked for again while another process finds its base lobes
    """
    key = state.digest()
    if key not in _models:
        _models[key] = _shader_model(state, group)
        if len(_models) > MOST_MODELS:
            _models.popitem(last=False)
    _models.move_to_end(key)
    return _models[key]


def _shader_model(state: State, group: bpy.types.ShaderNodeTree) -> Factors:
    model = state.measured
    if state.settings.edit.show_original:
        return model
    if state.share:
        model = blend(model, state.other, state.share)
    curves = before_and_after(state, curve_nodes.heights(group))
    model = edits.apply(model, Edits(*curves, state.sliders.for_model()))
    return _within_energy(model, state) if state.keep_energy else model


def diffuse_map(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Affine map (3, 3), (3,) of the Diffuse socket: blend, then hue and saturation.

    Where the socket has the measured colour, the blend is that of `fitter.editing.blend`.
    """
    sliders = state.sliders
    matrix = edits.color_matrix(sliders.diffuse_saturation, sliders.diffuse_hue)
    if not state.share:
        return matrix, np.zeros(3)
    first = np.pi * state.measured.diffuse
    second = np.pi * state.other.diffuse
    wanted = mix(first, second, state.share) if state.share < 1 else second
    apart = second - first
    differ = apart != 0
    weight = np.where(differ, (wanted - first) / np.where(differ, apart, 1), state.share)
    return matrix * (1 - weight), matrix @ (weight * second)


def largest_albedo(owner: bpy.types.Material) -> float:
    """Largest share of light that the edited material reflects, up to 87 degrees; 0 if unknown.

    With gains, and with the colours that are typed into the node's sockets.
    """
    if not owner.nfm.edit.albedo:
        return 0.0
    state = State(owner.nfm, {})
    sockets = find_group_node(owner).inputs
    tints = np.array([socket_color(sockets[name]) for name in LOBE_SOCKETS])
    matrix, offset = diffuse_map(state)
    diffuse = np.maximum(matrix @ socket_color(sockets["Diffuse"]) + offset, 0)
    lobes = np.array(json.loads(owner.nfm.edit.albedo))
    return float((np.einsum("lvc,lc,l->vc", lobes, tints, _gains(state)) + diffuse).max())


def _within_energy(model: Factors, state: State) -> Factors:
    """Lobes lowered so that they reflect, with their gains and the diffuse part, no more than 1."""
    gains = _gains(state)[:, None]
    limited = within_energy(_with_inputs(model, state))
    scale = np.where(gains > 0, limited.scale / np.where(gains > 0, gains, 1), 0)
    return replace(limited, scale=scale, diffuse=model.diffuse)


def _with_inputs(model: Factors, state: State) -> Factors:
    """The whole model: with gains, and with the measured diffuse colour as it is mapped."""
    matrix, offset = diffuse_map(state)
    diffuse = np.maximum(matrix @ (np.pi * state.measured.diffuse) + offset, 0) / np.pi
    return replace(model, scale=model.scale * _gains(state)[:, None], diffuse=diffuse)


def _gains(state: State) -> np.ndarray:
    return np.array([lobe.gain for lobe in state.sliders.lobes])


def socket_color(socket: bpy.types.NodeSocket) -> np.ndarray:
    """Linear RGB (3,) typed into a socket."""
    return np.array(socket.default_value[:3])
