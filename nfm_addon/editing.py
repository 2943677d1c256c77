# SPDX-License-Identifier: GPL-3.0-or-later
"""From curves, sliders and blend of a material to its shader.

`refresh` is the whole of it: it compares what a material asks for with what its shader was made
for, and does what is missing. Whoever changes something only has to see to it that `refresh` is
called (live.py).

A shader is made in two stages. While a person drags, the closures of the last base are kept, which
is quick; once they rest, and for every render, everything is as a fresh import would make it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import bpy
import numpy as np

from ..fitter import curves, edits, parameter_file
from ..fitter.blend import blend, mix
from ..fitter.closures import Closure
from ..fitter.curves import CURVES, Curves
from ..fitter.edit_document import EditDocument, Handles
from ..fitter.edits import Edits, Sliders
from ..fitter.limits import within_energy
from ..fitter.model import FactorModel
from . import curve_nodes, live_nodes, script_node, stand_in
from .edit_properties import set_sliders, sliders_of
from .errors import ShaderError
from .node_group import LOBE_SOCKETS, SCRIPT_NODE, find_group_node, find_script_node
from .shader_source import Surface, new_surface

_DRAFT = " draft"

# A few per cent off near grazing, and a sixth of the time.
_DRAFT_QUADRATURE = {"n_phi": 24, "n_per_bin": 2}


@dataclass(frozen=True)
class State:
    """What decides how a material looks.

    settings : material.nfm, or an evaluated copy with the values of a frame
    handles : of its curves; anisotropic materials have none
    """

    settings: bpy.types.PropertyGroup
    handles: dict

    @property
    def measured(self) -> FactorModel:
        """The model as measured."""
        return _parsed(self.settings.parameters, f"material {self.settings.id_data.name!r}")

    @property
    def other(self) -> FactorModel:
        """The model that this one is blended with."""
        edit = self.settings.edit
        return _parsed(edit.blend_parameters, f"material {edit.blend_name!r}")

    @property
    def sliders(self) -> Sliders:
        """Neutral while the original is shown."""
        edit = self.settings.edit
        return Sliders() if edit.show_original else sliders_of(edit)

    @property
    def share(self) -> float:
        """How much there is of the material it is blended with."""
        edit = self.settings.edit
        return 0.0 if edit.show_original or not edit.blend_parameters else edit.blend

    @property
    def keep_energy(self) -> bool:
        """Whether the lobes are lowered to what light there is."""
        return self.settings.edit.keep_energy and not self.settings.edit.show_original

    def digest(self) -> str:
        """The same for states that need the same shader."""
        edit = self.settings.edit
        # what the shader has as inputs matters only where it takes part in the albedo
        sliders = self.sliders if self.keep_energy else self.sliders.for_model()
        parts = (
            self.settings.parameters,
            self.settings.sampling,
            repr(sliders),
            self.share and (self.share, edit.blend_parameters),
            self.keep_energy,
            edit.show_original or (edit.drawn, self.handles),
        )
        return hashlib.sha256(repr(parts).encode()).hexdigest()


def state_of(owner: bpy.types.Material, settings: bpy.types.PropertyGroup | None = None) -> State:
    """The state of a material, or with the settings of a frame.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    return State(settings or owner.nfm, curve_nodes.handles(group_of(owner)))


def group_of(owner: bpy.types.Material) -> bpy.types.ShaderNodeTree:
    """The node group with the shader of a material.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    return find_script_node(owner).id_data


def is_drafted(owner: bpy.types.Material) -> bool:
    """Whether the shader shows what the material asks for, if only as a draft."""
    digest = state_of(owner).digest()
    return group_of(owner).nfm.applied in (digest, digest + _DRAFT)


def has_own_nodes(owner: bpy.types.Material) -> bool:
    """Whether there is a node group with a shader in this file, which can be changed."""
    try:
        group = group_of(owner)
    except ShaderError:
        return False
    return not (owner.library or group.library or group.override_library)


def give_up(owner: bpy.types.Material, settings: bpy.types.PropertyGroup | None = None) -> None:
    """Note that the shader for the present state cannot be made, and leave it as it is."""
    group_of(owner).nfm.applied = state_of(owner, settings).digest()


def refresh(
    owner: bpy.types.Material,
    settings: bpy.types.PropertyGroup | None = None,
    *,
    draft: bool = False,
) -> bool:
    """Make the shader what the material asks for; whether there was something to do.

    settings : with the values of a frame; None is owner.nfm
    draft : with the closures of the last base, and without their error

    Raises
    ------
    ParameterFileError
        The stored parameters were damaged.
    ShaderError
        This Blender cannot compile the shader, the material has lost its Script node, or its node
        group is linked.
    """
    state = state_of(owner, settings)
    digest = state.digest()
    group = group_of(owner)
    if group.nfm.applied != digest and not (draft and group.nfm.applied == digest + _DRAFT):
        group = own_group(owner)
        surface = _surface(owner, state, group, draft)
        script_node.fill(group.nodes[SCRIPT_NODE], f"{owner.name}.osl", surface.source)
        _remember(owner, group, surface, digest + (_DRAFT if draft else ""))
        if not draft:
            values = stand_in.put(group, _model(state, curve_nodes.heights(group)))
            stand_in.show_in_workbench(owner, values)
        changed = True
    else:
        changed = False
    gains = tuple(lobe.gain for lobe in state.sliders.lobes)
    return live_nodes.set_inputs(group, gains, *_diffuse_map(state)) or changed


def adopt(owner: bpy.types.Material, surface: Surface) -> None:
    """Note that a surface, just made, is the one that the material asks for."""
    _remember(owner, group_of(owner), surface, state_of(owner).digest())


def fitted_material(owner: bpy.types.Material) -> parameter_file.FittedMaterial:
    """The model that a material was made from, without edits.

    Raises
    ------
    ParameterFileError
        The material has none, or the stored text was damaged.
    """
    return parameter_file.loads(owner.nfm.parameters, f"material {owner.name!r}")


def draw_curves(owner: bpy.types.Material, handles: Handles | None = None) -> None:
    """Draw the curves of a material from its measurement; what was edited by hand is gone.

    handles : of curves that were drawn before, to have the same again
    """
    group = group_of(owner)
    model = fitted_material(owner).model
    if model.kind != "isotropic":
        return  # its D and G are no curves
    curve_nodes.ensure(group)
    curve_nodes.draw(group, curves.drawn(model).heights())
    curve_nodes.write(group, handles or {})
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

    Raises
    ------
    ParameterFileError, ShaderError
        As refresh.
    """
    group = own_group(owner)
    if fitted_material(owner).model.kind != "isotropic":
        return
    missing = set(CURVES) - set(curve_nodes.handles(group))
    if missing or not owner.nfm.edit.drawn:
        kept = {} if missing == set(CURVES) else curve_nodes.handles(group)
        draw_curves(owner, drawn_handles(owner))
        curve_nodes.write(group, {name: kept[name] for name in kept if name not in names})
    drawn = drawn_handles(owner)
    curve_nodes.write(group, {name: drawn[name] for name in names})


def document_of(owner: bpy.types.Material) -> EditDocument:
    """The edits of a material, to be written down.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    now, drawn = curve_nodes.handles(group_of(owner)), drawn_handles(owner)
    names = [name for name in CURVES if name in now and name in drawn]
    return EditDocument(
        curves={name: now[name] for name in names},
        drawn={name: drawn[name] for name in names},
        sliders=sliders_of(owner.nfm.edit),
    )


def apply_document(owner: bpy.types.Material, document: EditDocument) -> None:
    """Give a material the edits of another: its sliders, and those curves that were edited.

    Raises
    ------
    ShaderError
        The material has lost its Script node, or its node group is linked.
    """
    edited = {
        name: handles
        for name, handles in document.curves.items()
        if handles != document.drawn[name]
    }
    curve_nodes.write(own_group(owner), edited)
    set_sliders(owner.nfm.edit, document.sliders)


def largest_albedo(owner: bpy.types.Material) -> float:
    """Largest share of light that the edited material reflects, up to 87 degrees; 0 if unknown.

    With gains, and with the colours that are typed into the node's sockets.
    """
    state = State(owner.nfm, {})
    if not owner.nfm.edit.albedo:
        return 0.0
    sockets = find_group_node(owner).inputs
    tints = np.array([_color(sockets[name]) for name in LOBE_SOCKETS])
    gains = np.array([lobe.gain for lobe in state.sliders.lobes])
    matrix, offset = _diffuse_map(state)
    diffuse = np.maximum(matrix @ _color(sockets["Diffuse"]) + offset, 0)
    lobes = np.array(json.loads(owner.nfm.edit.albedo))
    return float((np.einsum("lvc,lc,l->vc", lobes, tints, gains) + diffuse).max())


def own_group(owner: bpy.types.Material) -> bpy.types.ShaderNodeTree:
    """The node group of a material, which gets a copy where others have the same.

    Raises
    ------
    ShaderError
        The group is linked from another file.
    """
    node = find_group_node(owner)
    group = node.node_tree
    if group.library or group.override_library:
        raise ShaderError(
            f"material {owner.name!r} has a node group from another file; make it local first"
        )
    if any(other != owner and _has_group(other, group) for other in measured_materials()):
        group = node.node_tree = group.copy()
    return group


def measured_materials() -> list[bpy.types.Material]:
    """Materials with a model, of this file and of linked ones."""
    return [item for item in bpy.data.materials if item.nfm.parameters]


def edited_model(owner: bpy.types.Material) -> FactorModel:
    """The model of a material as it is rendered, with all its edits.

    Raises
    ------
    ParameterFileError, ShaderError
        As refresh.
    """
    state = state_of(owner)
    model = _model(state, curve_nodes.heights(group_of(owner)))
    matrix, offset = _diffuse_map(state)
    gains = np.array([lobe.gain for lobe in state.sliders.lobes])
    measured = state.measured
    return replace(
        model,
        scale=model.scale * gains[:, None],
        diffuse=_diffuse(measured, matrix, offset),
    )


def _surface(
    owner: bpy.types.Material, state: State, group: bpy.types.ShaderNodeTree, draft: bool
) -> Surface:
    model = _model(state, curve_nodes.heights(group), draft=draft)
    closures = _closures.get(group.session_uid) if draft else None
    return new_surface(model, state.settings.sampling.lower(), closures, draft=draft)


def _model(state: State, heights: dict[str, np.ndarray], *, draft: bool = False) -> FactorModel:
    """The model that the shader's tables hold: without what are inputs."""
    model = state.measured
    edit = state.settings.edit
    if edit.show_original:
        return model
    if state.share:
        model = blend(model, state.other, state.share)
    before, after = _before_and_after(edit.drawn, state.handles, heights)
    model = edits.apply(model, Edits(before, after, state.sliders.for_model()))
    if state.keep_energy and model.kind == "isotropic":
        return _within_energy(model, state, draft)
    return model


def _before_and_after(
    drawn: str, handles: dict, heights: dict[str, np.ndarray]
) -> tuple[Curves | None, Curves | None]:
    """Heights of the curves as drawn and now; those that are as drawn, or not there, are equal."""
    if not drawn:
        return None, None
    stored = json.loads(drawn)
    before = {name: np.array(values) for name, values in stored["heights"].items()}
    if set(before) != set(CURVES):
        return None, None
    after = dict(before)
    for name, values in heights.items():
        # handles decide: heights may differ in the last digit between versions of Blender
        if [list(handle) for handle in handles[name]] != stored["handles"][name]:
            after[name] = values
    return Curves.from_heights(before), Curves.from_heights(after)


def _within_energy(model: FactorModel, state: State, draft: bool) -> FactorModel:
    """Lobes lowered so that they reflect, with their gains and the diffuse part, no more than 1."""
    gains = np.array([lobe.gain for lobe in state.sliders.lobes])[:, None]
    matrix, offset = _diffuse_map(state)
    measured = state.measured
    whole = replace(model, scale=model.scale * gains, diffuse=_diffuse(measured, matrix, offset))
    limited = within_energy(whole, **(_DRAFT_QUADRATURE if draft else {}))
    scale = np.where(gains > 0, limited.scale / np.where(gains > 0, gains, 1), 0)
    return replace(limited, scale=scale, diffuse=model.diffuse)


def _diffuse_map(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Affine map (3, 3), (3,) of the Diffuse socket: blend, then hue and saturation.

    Where the socket has the measured colour, the blend is that of `fitter.blend`.
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


def _color(socket: bpy.types.NodeSocket) -> np.ndarray:
    return np.array(socket.default_value[:3])


def _diffuse(measured: FactorModel, matrix: np.ndarray, offset: np.ndarray) -> np.ndarray:
    return np.maximum(matrix @ (np.pi * measured.diffuse) + offset, 0) / np.pi


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


def _has_group(other: bpy.types.Material, group: bpy.types.ShaderNodeTree) -> bool:
    try:
        return group_of(other) == group
    except ShaderError:
        return False


# The closures of each group's last base, by the group's number in this session. Lost when Blender
# ends, which costs the next edit their selection.
_closures: dict[int, tuple[Closure, ...]] = {}


@lru_cache(maxsize=8)
def _parsed(parameters: str, name: str) -> FactorModel:
    """A stored model; while a person drags it is the same one again and again."""
    return parameter_file.loads(parameters, name).model
