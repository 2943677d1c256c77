# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted material as Blender data: Material -> node group -> Script node -> Text.

The node group (node_group.py) has the sockets that an artist uses and hides the rest. The model
itself travels in material.nfm.parameters, as text.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ..fitter.errors import NfmError, printable
from ..fitter.formats import parameter_file
from ..fitter.formats.parameter_file import FittedMaterial
from ..fitter.models.anisotropy import Anisotropy, anisotropy
from ..osl import generate
from . import changes, editing, live, lobes, node_group, script_node, stand_in
from .editing import fitted_material
from .errors import ShaderError
from .node_group import GROUP_NAME, SCRIPT_NODE, find_group_node, find_script_node
from .node_trees import empty_tree
from .properties import DEFAULT_SAMPLING
from .shader_source import new_surface

__all__ = (
    "build",
    "change_sampling",
    "complete",
    "find_group_node",
    "find_script_node",
    "fitted_material",
    "needs_compiling",
    "remove",
    "replace_model",
)

CYCLES_OUTPUT, EEVEE_OUTPUT = "Cycles Output", "EEVEE Output"

# Figures of a fit that material.nfm has under the same name.
FIGURES = (
    "objective",
    "iterations",
    "mean_log_error",
    "largest_directional_albedo",
    "studio_psnr",
)

INT_MAX = 2**31 - 1  # of Blender's properties


def build(
    fitted: FittedMaterial, sampling: str = DEFAULT_SAMPLING, *, draft: bool = False
) -> bpy.types.Material:
    """New material of a fitted model; nothing is left behind if its shader does not compile.

    sampling : an identifier of properties.SAMPLING_ITEMS
    draft : as in editing.refresh; whoever asks for it requests the rest of live.py

    Raises
    ------
    ShaderError
        This Blender cannot compile the shader.
    """
    # with edits it is another one that is shown
    surface = new_surface(fitted.model, sampling.lower(), draft=draft or bool(fitted.edits))
    group = node_group.new_group(fitted.model)
    script = group.nodes[SCRIPT_NODE]
    try:
        script_node.fill(script, f"{fitted.name}.osl", surface.source)
    except ShaderError:
        text = script.script
        bpy.data.node_groups.remove(group)
        if text:
            bpy.data.texts.remove(text)
        raise
    values = node_group.add_inner_nodes(group, fitted.model)
    material = _new_material(fitted, group, sampling)
    stand_in.show_in_workbench(material, values)
    show_in_cycles(material)
    editing.draw_curves(material, fitted.edits and fitted.edits.drawn)
    editing.adopt(material, surface)
    if fitted.edits:
        editing.apply_document(material, fitted.edits)
        editing.refresh(material, draft=draft)
    return material


def change_sampling(material: bpy.types.Material) -> None:
    """Write the shader for the sampling in material.nfm, with that sampling's own Candidates.

    Raises
    ------
    ParameterFileError, ShaderError
        As editing.refresh.
    """
    live.show(material)
    candidates = find_script_node(material).inputs.get("Candidates")  # without OSL there is none
    if candidates:
        candidates.default_value = generate.DEFAULT_CANDIDATES[material.nfm.sampling.lower()]


def replace_model(
    material: bpy.types.Material, fitted: FittedMaterial, *, draft: bool = False
) -> None:
    """Give a material another model; scales, sliders and links stay, curves are drawn anew.

    Diffuse takes the colour of the new model where it still has that of the old one.

    draft : as in `build`

    Raises
    ------
    ParameterFileError, ShaderError
        As editing.refresh; the material is then as it was.
    NfmError
        One of the models is anisotropic: their nodes differ.
    """
    before = fitted_material(material)
    if fitted.model.kind != before.model.kind:
        raise NfmError(
            f"{printable(fitted.name)} is {fitted.model.kind} and material {material.name!r} "
            f"{before.model.kind}; import it as a new material"
        )
    editing.own_group(material)
    node = find_group_node(material)
    socket = node.inputs["Diffuse"]
    follows = np.allclose(socket.default_value[:3], np.pi * before.model.diffuse, atol=1e-6)
    _store(material, fitted)
    try:
        editing.draw_curves(material)
        editing.refresh(material, draft=draft)
    except NfmError:
        _store(material, before)
        editing.draw_curves(material)
        raise
    color = (*(np.pi * fitted.model.diffuse), 1.0)
    node.node_tree.interface.items_tree["Diffuse"].default_value = color
    if follows:
        socket.default_value = color


def complete(material: bpy.types.Material) -> None:
    """Compile a material that was made where there was no OSL.

    Raises
    ------
    ParameterFileError, ShaderError
        As editing.refresh.
    """
    group = editing.own_group(material)
    group.nfm.applied = ""
    live.show(material)
    node_group.link(group)
    show_in_cycles(material)


def needs_compiling(material: bpy.types.Material) -> bool:
    """Whether a material of ours was made where there was no OSL, and never compiled since."""
    try:
        return not find_script_node(material).bytecode
    except ShaderError:
        return False


def show_in_cycles(material: bpy.types.Material) -> None:
    """Connect what Cycles renders: the Script node, or the stand-in where there is no OSL."""
    output = material.node_tree.nodes.get(CYCLES_OUTPUT)
    if output:
        shown = stand_in.OUTPUT if needs_compiling(material) else "BSDF"
        source = find_group_node(material).outputs[shown]
        material.node_tree.links.new(source, output.inputs["Surface"])


def show_audible_lobes(material: bpy.types.Material) -> None:
    """Show the lobes that material.nfm.mute and solo leave.

    Raises
    ------
    ShaderError
        The material has lost its node group or is linked.
    """
    settings = material.nfm
    group = editing.own_group(material)
    lobes.show(group, lobes.audible(settings.mute, settings.solo))


def remove(material: bpy.types.Material) -> None:
    """Remove a material with its node group and Text, unless others use them."""
    group = find_group_node(material).node_tree
    text = group.nodes[SCRIPT_NODE].script
    bpy.data.materials.remove(material)
    if group.users == 0:
        bpy.data.node_groups.remove(group)
        if text and text.users == 0:
            bpy.data.texts.remove(text)


def _new_material(
    fitted: FittedMaterial, group: bpy.types.ShaderNodeTree, sampling: str
) -> bpy.types.Material:
    material = bpy.data.materials.new(fitted.name)
    tree = empty_tree(material)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.name = node.label = GROUP_NAME
    node.width = 200
    for row, (target, name) in enumerate((("CYCLES", CYCLES_OUTPUT), ("EEVEE", EEVEE_OUTPUT))):
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.name = output.label = name
        output.target = target
        output.location = (320, -160 * row)
    tree.links.new(node.outputs[stand_in.OUTPUT], output.inputs["Surface"])

    # before `parameters`: without them its update callback leaves the new shader alone
    material.nfm.sampling = sampling
    _store(material, fitted)
    return material


def _store(material: bpy.types.Material, fitted: FittedMaterial) -> None:
    """Keep the model and its figures in material.nfm."""
    settings = material.nfm
    settings.parameters = parameter_file.dumps(replace(fitted, edits=None))
    settings.model = parameter_file.MODEL
    settings.numbers = fitted.model.n_parameters
    main = anisotropy(fitted.model) if fitted.model.kind == "anisotropic" else Anisotropy(0.0, 0.0)
    settings.anisotropy_direction = main.direction
    settings.anisotropy_strength = main.strength
    if fitted.source:
        settings.source = fitted.source.file_name
        settings.source_format = fitted.source.format
    settings.quality = str(fitted.fit.get("quality", ""))
    for name in FIGURES:
        value = fitted.fit.get(name)
        if isinstance(value, (int, float)):
            if name == "iterations":  # a file may say anything
                value = max(-INT_MAX, min(int(value), INT_MAX))
            setattr(settings, name, value)
        else:
            settings.property_unset(name)


def register() -> None:
    changes.sampling.listen(change_sampling)
    changes.audible.listen(show_audible_lobes)


def unregister() -> None:
    changes.sampling.forget(change_sampling)
    changes.audible.forget(show_audible_lobes)
