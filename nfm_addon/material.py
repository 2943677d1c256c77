# SPDX-License-Identifier: GPL-3.0-or-later
"""A fitted material as Blender data: Material -> node group -> Script node -> Text.

The node group has the sockets that an artist uses (Diffuse, Lobe 1-3 Scale, Normal -> BSDF) and
hides the rest. The model itself travels in material.nfm.parameters, as text.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..fitter import parameter_file
from ..fitter.model import FactorModel
from ..fitter.parameter_file import FittedMaterial
from ..osl import generate
from . import script_node, stand_in
from .errors import ShaderError
from .node_trees import empty_tree
from .properties import DEFAULT_SAMPLING
from .shader_source import Surface, new_surface

GROUP_NAME = "NFM BRDF"
SCRIPT_NODE = "NFM Shader"
CYCLES_OUTPUT, EEVEE_OUTPUT = "Cycles Output", "EEVEE Output"

LOBE_SOCKETS = ("Lobe 1 Scale", "Lobe 2 Scale", "Lobe 3 Scale")
WHITE = (1.0, 1.0, 1.0, 1.0)

# Figures of a fit that material.nfm has under the same name.
FIGURES = (
    "objective",
    "iterations",
    "mean_log_error",
    "largest_directional_albedo",
    "studio_psnr",
)

INT_MAX = 2**31 - 1  # of Blender's properties


def build(fitted: FittedMaterial, sampling: str = DEFAULT_SAMPLING) -> bpy.types.Material:
    """New material of a fitted model; nothing is left behind if its shader does not compile.

    sampling : an identifier of properties.SAMPLING_ITEMS

    Raises
    ------
    ShaderError
        This Blender cannot compile the shader.
    """
    surface = new_surface(fitted.model, sampling.lower())
    group = _new_group(fitted.model)
    script = group.nodes[SCRIPT_NODE]
    try:
        script_node.fill(script, f"{fitted.name}.osl", surface.source)
    except ShaderError:
        text = script.script
        bpy.data.node_groups.remove(group)
        if text:
            bpy.data.texts.remove(text)
        raise
    values = stand_in.put(group, fitted.model)
    material = _new_material(fitted, group, sampling)
    stand_in.show_in_workbench(material, values)
    _link_shader(material)
    _report_error(material, surface)
    return material


def update_shader(material: bpy.types.Material) -> None:
    """Write the shader anew from material.nfm: after a change of its sampling or parameters.

    Raises
    ------
    ParameterFileError
        The stored parameters were damaged.
    ShaderError
        This Blender cannot compile the shader, or the material has lost its Script node.
    """
    model = fitted_material(material).model
    surface = new_surface(model, material.nfm.sampling.lower())
    script_node.fill(find_script_node(material), f"{material.name}.osl", surface.source)
    _link_shader(material)
    _report_error(material, surface)


def needs_compiling(material: bpy.types.Material) -> bool:
    """Whether a material of ours was made where there was no OSL, and never compiled since."""
    try:
        return not find_script_node(material).bytecode
    except ShaderError:
        return False


def replace_model(material: bpy.types.Material, fitted: FittedMaterial) -> None:
    """Give a material another model; what an artist has set stays, and all links.

    Diffuse takes the colour of the new model where it still has that of the old one.

    Raises
    ------
    ParameterFileError, ShaderError
        As update_shader; the material is then as it was.
    """
    surface = new_surface(fitted.model, material.nfm.sampling.lower())
    script = find_script_node(material)
    script_node.fill(script, f"{material.name}.osl", surface.source)
    socket = script.id_data.interface.items_tree["Diffuse"]
    before = socket.default_value[:]
    socket.default_value = (*(np.pi * fitted.model.diffuse), 1.0)
    diffuse = find_group_node(material).inputs["Diffuse"]
    if diffuse.default_value[:] == before:
        diffuse.default_value = socket.default_value
    stand_in.show_in_workbench(material, stand_in.put(script.id_data, fitted.model))
    _store(material, fitted)
    _report_error(material, surface)


def remove(material: bpy.types.Material) -> None:
    """Remove a material with its node group and Text, unless others use them."""
    group = find_group_node(material).node_tree
    text = group.nodes[SCRIPT_NODE].script
    bpy.data.materials.remove(material)
    if group.users == 0:
        bpy.data.node_groups.remove(group)
        if text and text.users == 0:
            bpy.data.texts.remove(text)


def change_sampling(material: bpy.types.Material) -> None:
    """Write the shader for the sampling in material.nfm, with that sampling's own Candidates.

    Raises
    ------
    ParameterFileError, ShaderError
        As update_shader.
    """
    update_shader(material)
    candidates = find_script_node(material).inputs.get("Candidates")
    if candidates:
        default = generate.DEFAULT_CANDIDATES[material.nfm.sampling.lower()]
        candidates.default_value = default


def fitted_material(material: bpy.types.Material) -> FittedMaterial:
    """The model that a material was made from.

    Raises
    ------
    ParameterFileError
        The material has none, or the stored text was damaged.
    """
    return parameter_file.loads(material.nfm.parameters, f"material {material.name!r}")


def find_script_node(material: bpy.types.Material) -> bpy.types.ShaderNodeScript:
    """The Script node of a material that `build` has made.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    return find_group_node(material).node_tree.nodes[SCRIPT_NODE]


def find_group_node(material: bpy.types.Material) -> bpy.types.ShaderNodeGroup:
    """The node of a material that holds its Script node's group.

    Raises
    ------
    ShaderError
        There is none any more.
    """
    tree = material.node_tree  # None until Blender 5.0, for a material without nodes
    for node in tree.nodes if tree else ():
        if node.type == "GROUP" and node.node_tree and SCRIPT_NODE in node.node_tree.nodes:
            return node
    raise ShaderError(
        f"material {material.name!r} has no {GROUP_NAME} node any more; import it again"
    )


def _report_error(material: bpy.types.Material, surface: Surface) -> None:
    """Tell the material's properties how good its base lobes are, if it has any."""
    if surface.error:
        material.nfm.native_error = surface.error.image
        material.nfm.native_psnr = min(surface.error.psnr, 200.0)
        material.nfm.native_share = max(1 - surface.error.directional, 0.0)


def _new_group(model: FactorModel) -> bpy.types.ShaderNodeTree:
    group = bpy.data.node_groups.new(GROUP_NAME, "ShaderNodeTree")
    interface = group.interface
    interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    diffuse = interface.new_socket("Diffuse", in_out="INPUT", socket_type="NodeSocketColor")
    diffuse.default_value = (*(np.pi * model.diffuse), 1.0)
    diffuse.description = "Colour of the diffuse reflection, as fitted"
    for name in LOBE_SOCKETS:
        scale = interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketColor")
        scale.default_value = WHITE
        scale.description = "Multiplies this specular lobe; white is as measured"
    normal = interface.new_socket("Normal", in_out="INPUT", socket_type="NodeSocketVector")
    normal.hide_value = True

    script = group.nodes.new("ShaderNodeScript")
    script.name = script.label = SCRIPT_NODE
    script.width = 220
    entry = group.nodes.new("NodeGroupInput")
    entry.location = (-300, 0)
    exit_ = group.nodes.new("NodeGroupOutput")
    exit_.location = (320, 0)
    return group


def _link_shader(material: bpy.types.Material) -> None:
    """Connect what Cycles renders: the Script node, or the stand-in where there is no OSL.

    The Script node's sockets exist only once it is compiled.
    """
    node = find_group_node(material)
    group = node.node_tree
    script = group.nodes[SCRIPT_NODE]
    if script.bytecode and not any(socket.is_linked for socket in script.outputs):
        nodes = {node.bl_idname: node for node in group.nodes}
        entry, exit_ = nodes["NodeGroupInput"], nodes["NodeGroupOutput"]
        for name in ("Diffuse", *LOBE_SOCKETS, "Normal"):
            group.links.new(entry.outputs[name], script.inputs[name])
        group.links.new(script.outputs["BSDF"], exit_.inputs["BSDF"])
        for socket in (*script.inputs, *script.outputs):
            socket.hide = not socket.is_linked
    output = material.node_tree.nodes.get(CYCLES_OUTPUT)
    if output:
        shown = "BSDF" if script.bytecode else stand_in.OUTPUT
        material.node_tree.links.new(node.outputs[shown], output.inputs["Surface"])


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
    settings.parameters = parameter_file.dumps(fitted)
    settings.model = parameter_file.MODEL
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
