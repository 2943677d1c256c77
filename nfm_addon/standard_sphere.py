# SPDX-License-Identifier: GPL-3.0-or-later
"""The standard scene: a unit sphere under an environment, the same for every figure we publish.

Unit sphere at the origin with smooth normals; orthographic camera at (0, -4, 0) looking along +Y,
up +Z, 2.2 units wide; world = the map in Blender's default orientation, or uniform white 1. No
denoising, no clamping, no glossy filter: the picture is the estimator's own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from . import images
from .node_trees import empty_tree
from .rendering import render_settings

CAMERA_WIDTH = 2.2

# Fine enough that facets do not show: the normal between vertices is off by less than 1e-5.
SEGMENTS, RINGS = 512, 256


@dataclass(frozen=True)
class SphereView:
    """How to look at the sphere.

    resolution : pixels along each side
    samples : per pixel
    seed : of Cycles
    point_sampled : rays through the pixel centres instead of a box filter one pixel wide
    environment : map for the world; None is uniform white
    """

    resolution: int = 256
    samples: int = 64
    seed: int = 0
    point_sampled: bool = False
    environment: Path | None = None


def build_scene(material: bpy.types.Material, view: SphereView) -> bpy.types.Scene:
    """A new scene with the sphere, camera, world and render settings.

    Raises
    ------
    NfmError
        The environment map cannot be read.
    """
    scene = bpy.data.scenes.new("NFM Standard Sphere")
    scene.world = new_world(view.environment)
    sphere = bpy.data.objects.new("Sphere", _sphere_mesh())
    sphere.data.materials.append(material)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = CAMERA_WIDTH
    camera.location = (0, -4, 0)
    camera.rotation_euler = (math.pi / 2, 0, 0)
    for item in (sphere, camera):
        scene.collection.objects.link(item)
    scene.camera = camera
    render_settings(scene, view.resolution, view.resolution, view.samples, view.seed)
    if view.point_sampled:
        scene.cycles.pixel_filter_type = "GAUSSIAN"  # Cycles ignores the width of a box
        scene.cycles.filter_width = 0.01
    # Cycles turns rays within half a degree of the horizon away from it, to soften bump maps.
    # There is no bump map here, and the picture is meant to be exact.
    material.cycles.use_bump_map_correction = False
    return scene


def new_world(environment: Path | None) -> bpy.types.World:
    """A world of strength 1: the map, or uniform white."""
    image = environment and images.load_environment(environment)
    world = bpy.data.worlds.new("NFM World")
    tree = empty_tree(world)
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    background.inputs["Strength"].default_value = 1
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    if image:
        texture = tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = image
        tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    return world


def _sphere_mesh() -> bpy.types.Mesh:
    """Longitude-latitude sphere with smooth normals, poles at +-Z."""
    theta = np.arange(1, RINGS) / RINGS * np.pi
    phi = np.arange(SEGMENTS) / SEGMENTS * 2 * np.pi
    theta, phi = theta[:, None], phi[None, :]
    rings = np.stack(
        np.broadcast_arrays(
            np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
        ),
        -1,
    ).reshape(-1, 3)
    top, bottom = len(rings), len(rings) + 1
    corner = np.arange(len(rings)).reshape(RINGS - 1, SEGMENTS)
    beside = np.roll(corner, -1, axis=1)
    quads = np.stack([corner[:-1], corner[1:], beside[1:], beside[:-1]], -1).reshape(-1, 4)
    caps = [(top, a, b) for a, b in zip(corner[0], beside[0], strict=True)]
    caps += [(bottom, b, a) for a, b in zip(corner[-1], beside[-1], strict=True)]
    mesh = bpy.data.meshes.new("Sphere")
    vertices = [*rings.tolist(), (0, 0, 1), (0, 0, -1)]
    mesh.from_pydata(vertices, [], [*quads.tolist(), *caps])
    mesh.shade_smooth()
    return mesh
