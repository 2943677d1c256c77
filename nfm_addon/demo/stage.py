# SPDX-License-Identifier: GPL-3.0-or-later
"""The set of the demo: steps before a backdrop, soft boxes, a camera, and how it is rendered.

Everything that is bright is a soft box whose light fades towards its edges, so that polished forms
reflect gradients and not white rectangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from mathutils import Vector

from ..node_trees import empty_tree
from ..rendering import render_settings
from .forms import extruded_mesh, rounded

WIDTH, HEIGHT, SAMPLES = 960, 540, 128

# Heights of the rows, and how far behind the first they are.
ROWS = ((0.0, 0.0), (1.42, 0.40), (3.05, 0.86))

# (y, z): the floor before the first row, two steps, and the backdrop, which has no corner.
STAGE_PROFILE = (
    (-9.0, 0.0),
    (-2.0, 0.0),
    (0.60, 0.0),
    (0.70, 0.0),
    (0.72, 0.02),
    (0.72, 0.36),
    (0.74, 0.40),
    (0.78, 0.40),
    (2.05, 0.40),
    (2.15, 0.40),
    (2.17, 0.42),
    (2.17, 0.82),
    (2.19, 0.86),
    (2.23, 0.86),
    (4.2, 0.86),
    (6.2, 0.86),
    (7.6, 1.6),
    (8.2, 4.0),
    (8.4, 9.0),
)
STAGE_WIDTH = 40.0
STAGE_COLOR = (0.075, 0.073, 0.075, 1.0)

CAMERA, TARGET, LENS = (0.0, -10.6, 3.3), (0.0, 1.35, 1.0), 60.0

AMBIENT = (0.055, 0.058, 0.066, 1.0)


@dataclass(frozen=True)
class SoftBox:
    """A rectangular lamp that fades towards its edges.

    place, target : metres
    size : width and height, metres
    power : watts if it did not fade
    color : linear RGB
    """

    name: str
    place: tuple[float, float, float]
    target: tuple[float, float, float]
    size: tuple[float, float]
    power: float
    color: tuple[float, float, float]


SOFT_BOXES = (
    SoftBox("Key", (-4.6, -4.4, 5.0), (0.2, 1.0, 0.6), (3.2, 3.2), 1250.0, (1.0, 0.91, 0.80)),
    SoftBox("Strip", (5.0, -1.8, 2.4), (0.0, 1.2, 0.8), (0.9, 4.6), 520.0, (0.74, 0.87, 1.0)),
    SoftBox("Rim", (-5.6, 5.4, 4.6), (0.4, 1.0, 0.9), (1.2, 3.0), 420.0, (0.9, 0.95, 1.0)),
    SoftBox("Top", (0.6, 2.6, 6.2), (0.2, 1.4, 0.0), (5.0, 1.4), 420.0, (1.0, 0.98, 0.95)),
    SoftBox("Backdrop", (0.0, 5.4, 3.4), (0.0, 8.2, 2.2), (2.4, 0.8), 260.0, (0.78, 0.88, 1.0)),
)


def add_stage(scene: bpy.types.Scene) -> None:
    """Add the steps with the backdrop, the lamps, the world and the camera."""
    mesh = extruded_mesh("Stage", rounded(STAGE_PROFILE, pieces=6), STAGE_WIDTH)
    mesh.materials.append(plain_material("Stage", STAGE_COLOR))
    scene.collection.objects.link(bpy.data.objects.new("Stage", mesh))
    for box in SOFT_BOXES:
        scene.collection.objects.link(_lamp(box))
    scene.world = _world()
    scene.camera = _camera()
    scene.collection.objects.link(scene.camera)


def set_up_render(scene: bpy.types.Scene) -> None:
    """960 x 540 with 128 samples, denoised; the picture is written beside the file."""
    render_settings(scene, WIDTH, HEIGHT, SAMPLES, seed=0)
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    cycles = scene.cycles
    # pixels that are clean enough, most of the stage, stop before the last sample
    cycles.use_adaptive_sampling, cycles.adaptive_threshold = True, 0.03
    cycles.use_denoising = True
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    # Forms reflect each other and the stage; what a matte surface sends to another one is left to
    # the ambient light, since it would double the time. Five lamps need no tree.
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 1, 0, 1
    cycles.use_light_tree = False
    cycles.transmission_bounces = cycles.transparent_max_bounces = cycles.volume_bounces = 0
    scene.render.filepath = "//demo-"
    scene.render.image_settings.file_format = "PNG"
    scene.frame_start = scene.frame_end = scene.frame_current = 1


def plain_material(name: str, color: tuple[float, float, float, float]) -> bpy.types.Material:
    """A matte material."""
    material = bpy.data.materials.new(name)
    _shade(material, "ShaderNodeBsdfDiffuse", "ShaderNodeOutputMaterial", color)
    material.diffuse_color = color
    return material


def aimed(place: tuple[float, float, float], target: tuple[float, float, float]) -> object:
    """Rotation of a lamp or camera that looks from here to there, up being up."""
    return (Vector(target) - Vector(place)).to_track_quat("-Z", "Y").to_euler()


def _lamp(box: SoftBox) -> bpy.types.Object:
    lamp = bpy.data.lights.new(box.name, "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = box.size
    lamp.energy, lamp.color = box.power, box.color
    lamp.cycles.use_multiple_importance_sampling = True
    _fade(lamp)
    item = bpy.data.objects.new(box.name, lamp)
    item.location, item.rotation_euler = box.place, aimed(box.place, box.target)
    item.visible_camera = False
    return item


def _fade(lamp: bpy.types.Light) -> None:
    """Let the light fade from the middle of a lamp to its edges, (16 u (1-u) v (1-v))^0.7."""
    tree = empty_tree(lamp)
    place = tree.nodes.new("ShaderNodeNewGeometry")
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(place.outputs["Parametric"], split.inputs["Vector"])

    def math(operation: str, *values: object) -> bpy.types.NodeSocket:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        for socket, value in zip(node.inputs, values, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node.outputs["Value"]

    humps = [
        math("MULTIPLY", split.outputs[axis], math("SUBTRACT", 1.0, split.outputs[axis]))
        for axis in ("X", "Y")
    ]
    product = math("MULTIPLY", math("MULTIPLY", humps[0], 16.0), humps[1])
    emission = tree.nodes.new("ShaderNodeEmission")
    strength = math("POWER", math("MAXIMUM", product, 0.0), 0.7)
    tree.links.new(strength, emission.inputs["Strength"])
    output = tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    for column, node in enumerate(tree.nodes):
        node.location = (200 * column, 0)


def _world() -> bpy.types.World:
    world = bpy.data.worlds.new("Studio")
    _shade(world, "ShaderNodeBackground", "ShaderNodeOutputWorld", AMBIENT)
    return world


def _shade(
    owner: bpy.types.Material | bpy.types.World,
    shader: str,
    output: str,
    color: tuple[float, float, float, float],
) -> None:
    """Give the owner a shader of one colour."""
    tree = empty_tree(owner)
    source, target = tree.nodes.new(shader), tree.nodes.new(output)
    source.inputs["Color"].default_value = color
    target.location = (220, 0)
    tree.links.new(source.outputs[0], target.inputs["Surface"])


def _camera() -> bpy.types.Object:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = LENS
    camera.location, camera.rotation_euler = CAMERA, aimed(CAMERA, TARGET)
    return camera
