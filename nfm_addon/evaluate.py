# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluate the very shader that renders, inside Cycles, for given pairs of directions.

Each pair becomes one square of a flat mesh facing +Z, seen by one pixel. The directions are face
attributes that feed the sockets View Direction and Light Direction; the output Value is emitted.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import bpy
import numpy as np

from ..fitter.models.factors import Factors
from . import script_node
from .images import read_linear
from .node_trees import empty_tree
from .rendering import remove_scene, render_settings, render_to_file
from .shader_source import new_surface

# Pairs in one render; a picture of 512 x 512.
CHUNK = 512 * 512

# Blender renders no smaller picture.
SMALLEST_SIDE = 4


def evaluate_through_osl(model: Factors, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """BRDF (n, 3) in 1/sr for unit directions (n, 3), as single precision OSL computes it.

    Raises
    ------
    ShaderError
        This Blender has no OSL.
    """
    script_node.require_osl()
    parts = [
        _evaluate_chunk(model, wi[first : first + CHUNK], wo[first : first + CHUNK])
        for first in range(0, len(wi), CHUNK)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, 3))


def _evaluate_chunk(model: Factors, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    side = max(math.ceil(math.sqrt(len(wi))), SMALLEST_SIDE)
    scene = bpy.data.scenes.new("NFM Evaluate")
    material = bpy.data.materials.new("NFM Evaluate")
    try:
        _emit_value(material, model)
        squares = bpy.data.objects.new("Squares", _squares_mesh(side, wi, wo))
        squares.data.materials.append(material)
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.data.type = "ORTHO"
        camera.data.ortho_scale = side
        camera.location = (side / 2, side / 2, 1)  # looks along -Z without rotation
        for item in (squares, camera):
            scene.collection.objects.link(item)
        scene.camera = camera
        render_settings(scene, side, side, samples=1, seed=0)
        scene.cycles.pixel_filter_type = "GAUSSIAN"
        scene.cycles.filter_width = 0.01
        with tempfile.TemporaryDirectory(prefix="nfm-") as folder:
            path = Path(folder) / "values.exr"
            render_to_file(scene, path)
            pixels = read_linear(path)
    finally:
        texts = {node.script for node in material.node_tree.nodes if node.type == "SCRIPT"}
        bpy.data.batch_remove([material, *(texts - {None})])
        remove_scene(scene)
    # the mesh counts upwards, the picture downwards
    return pixels[::-1].reshape(-1, 3)[: len(wi)].astype(np.float64)


def _emit_value(material: bpy.types.Material, model: Factors) -> None:
    tree = empty_tree(material)
    script = tree.nodes.new("ShaderNodeScript")
    script_node.fill(script, "NFM Evaluate.osl", new_surface(model, "reference").source)
    for name, socket in (("wi", "Light Direction"), ("wo", "View Direction")):
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = name
        tree.links.new(attribute.outputs["Vector"], script.inputs[socket])
    if model.kind == "anisotropic":
        script.inputs["Tangent"].default_value = (1, 0, 0)
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(script.outputs["Value"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])


def _squares_mesh(side: int, wi: np.ndarray, wo: np.ndarray) -> bpy.types.Mesh:
    count = len(wi)
    x, y = np.arange(count) % side, np.arange(count) // side
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    origin = np.stack([x, y, np.zeros(count, int)], -1)
    vertices = (origin[:, None, :] + corners).reshape(-1, 3)
    faces = np.arange(4 * count).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Squares")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    for name, directions in (("wi", wi), ("wo", wo)):
        attribute = mesh.attributes.new(name, "FLOAT_VECTOR", "FACE")
        attribute.data.foreach_set("vector", directions.astype(np.float32).ravel())
    return mesh
