# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted material as Blender data: Material -> node group -> Script node -> Text.

The node group (node_group.py) has the sockets that an artist uses and hides the rest. The model
itself travels in material.nfm.parameters, as text.
"""

from __future__ import annotations

from dataclasses import replace

import bpy

from ..fitter import parameter_file
from ..fitter.parameter_file import FittedMaterial
from ..osl import generate
from . import editing, node_group, script_node
from .editing import fitted_material
from .errors import ShaderError
from .node_group import GROUP_NAME, SCRIPT_NODE, find_group_node, find_script_node
from .node_trees import empty_tree
from .properties import DEFAULT_SAMPLING
from .shader_source import available_sampling, new_surface

__all__ = ("build", "change_sampling", "find_group_node", "find_script_node", "fitted_material")

INT_MAX = 2**31 - 1  # of Blender's properties


def build(fitted: FittedMaterial, sampling: str = DEFAULT_SAMPLING) -> bpy.types.Material:
    """New material of a fitted model; nothing is left behind if its shader does not compile.

    sampling : an identifier of properties.SAMPLING_ITEMS; REFERENCE replaces one that the kind of
        model does not have

    Raises
    ------
    ShaderError
        This Blender cannot compile the shader.
    """
    sampling = available_sampling(fitted.model, sampling.lower()).upper()
    surface = new_surface(fitted.model, sampling.lower())
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
    node_group.link(group)
    material = _new_material(fitted, group, sampling)
    editing.draw_curves(material, fitted.edits and fitted.edits.drawn)
    editing.adopt(material, surface)
    if fitted.edits:
        editing.apply_document(material, fitted.edits)
        editing.refresh(material)
    return material


def change_sampling(material: bpy.types.Material) -> None:
    """Write the shader for the sampling in material.nfm, with that sampling's own Candidates.

    A sampling that the kind of model does not have becomes REFERENCE.

    Raises
    ------
    ParameterFileError, ShaderError
        As editing.refresh.
    """
    wanted = material.nfm.sampling
    sampling = available_sampling(fitted_material(material).model, wanted.lower())
    if sampling != wanted.lower():
        material.nfm.sampling = sampling.upper()  # comes back here
        return
    editing.refresh(material)
    candidates = generate.DEFAULT_CANDIDATES[sampling]
    find_script_node(material).inputs["Candidates"].default_value = candidates


def _new_material(
    fitted: FittedMaterial, group: bpy.types.ShaderNodeTree, sampling: str
) -> bpy.types.Material:
    material = bpy.data.materials.new(fitted.name)
    tree = empty_tree(material)
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.name = node.label = GROUP_NAME
    node.width = 200
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (320, 0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])

    settings = material.nfm
    # before `parameters`: without them its update callback leaves the new shader alone
    settings.sampling = sampling
    settings.parameters = parameter_file.dumps(replace(fitted, edits=None))
    settings.model = parameter_file.MODEL
    if fitted.source:
        settings.source = fitted.source.file_name
        settings.source_format = fitted.source.format
    for name in ("objective", "iterations", "mean_log_error", "largest_directional_albedo"):
        value = fitted.fit.get(name)
        if isinstance(value, (int, float)):
            if name == "iterations":  # a file may say anything
                value = max(-INT_MAX, min(int(value), INT_MAX))
            setattr(settings, name, value)
    return material
