# SPDX-License-Identifier: GPL-3.0-or-later
"""Three cloths over balls that show one woven material at three rotations.

The cloths are the same mesh with the same light; what differs is the Rotation of the material, in
degrees from the thread direction U.
"""

from __future__ import annotations

import math

import bpy
import numpy as np

from .drape import draped_cloth
from .node_group import find_group_node
from .node_trees import empty_tree
from .rendering import render_settings
from .standard_sphere import SphereView, new_world

ROTATIONS = (0.0, 45.0, 90.0)
SPACING = 2.25
TURN = math.radians(20)  # of the cloths, so that no fold faces the camera squarely
FLOOR = -1.02

# Pictures are three times as wide as high: one square for each cloth.
CAMERA_DISTANCE, CAMERA_HEIGHT, CAMERA_LENS = 14.0, 3.4, 76.0


def build_cloth_scene(material: bpy.types.Material, view: SphereView) -> bpy.types.Scene:
    """A new scene with the cloths; view.resolution is its height in pixels.

    Raises
    ------
    NfmError
        The environment map cannot be read.
    """
    scene = bpy.data.scenes.new("NFM Cloth")
    scene.world = new_world(view.environment)
    mesh = cloth_mesh()
    for column, rotation in enumerate(ROTATIONS):
        cloth = bpy.data.objects.new(f"Cloth {rotation:.0f}", mesh)
        cloth.location = (SPACING * (column - 1), 0, 0)
        cloth.rotation_euler = (0, 0, TURN)
        scene.collection.objects.link(cloth)
        # the mesh is shared, so each object has a material of its own
        if not mesh.materials:
            mesh.materials.append(None)
        cloth.material_slots[0].link = "OBJECT"
        cloth.material_slots[0].material = turned(material, rotation)
    scene.collection.objects.link(_floor())
    scene.camera = _camera()
    scene.collection.objects.link(scene.camera)
    render_settings(scene, 3 * view.resolution, view.resolution, view.samples, view.seed)
    return scene


def turned(material: bpy.types.Material, rotation: float) -> bpy.types.Material:
    """A copy of a material with another Rotation; an isotropic one has none to turn."""
    copy = material.copy()
    socket = find_group_node(copy).inputs.get("Rotation")
    if socket:
        socket.default_value += rotation
    return copy


def cloth_mesh() -> bpy.types.Mesh:
    """The draped cloth as a smooth mesh with one UV map."""
    position, uv = draped_cloth()
    side = len(position)
    index = np.arange(side * side).reshape(side, side)
    faces = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], -1)
    faces = faces.reshape(-1, 4)
    mesh = bpy.data.meshes.new("Draped Cloth")
    mesh.from_pydata(position.reshape(-1, 3).tolist(), [], faces.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", uv.reshape(-1, 2)[faces.ravel()].astype(np.float32).ravel())
    mesh.shade_smooth()
    return mesh


def _floor() -> bpy.types.Object:
    size = 60.0
    mesh = bpy.data.meshes.new("Floor")
    corners = [(-size, -size, FLOOR), (size, -size, FLOOR), (size, size, FLOOR)]
    mesh.from_pydata([*corners, (-size, size, FLOOR)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("NFM Floor")
    tree = empty_tree(material)
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.18, 0.18, 0.18, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    mesh.materials.append(material)
    return bpy.data.objects.new("Floor", mesh)


def _camera() -> bpy.types.Object:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = CAMERA_LENS
    camera.location = (0, -CAMERA_DISTANCE, CAMERA_HEIGHT)
    down = math.atan2(CAMERA_HEIGHT + 0.2, CAMERA_DISTANCE)
    camera.rotation_euler = (math.pi / 2 - down, 0, 0)
    return camera
