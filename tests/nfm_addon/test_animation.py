# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframed sliders, scales and blend: every frame is rendered with the shader of that frame."""

import numpy as np
import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS

FRAMES = 24


@pytest.fixture
def build(addon):
    def make():
        module = addon("material")
        material = module.build(FittedMaterial("paint", MODELS["paint"]), "REFERENCE")
        other = FittedMaterial("metal", MODELS["metal"])
        material.nfm.edit.blend_parameters = parameter_file.dumps(other)
        return material, module.find_group_node(material).inputs["Lobe 3 Scale"]

    return make


def set_values(material, scale, share):
    """Values of the animation at a share of its way; what they are, by name."""
    edit = material.nfm.edit
    edit.lobe_2.width = 1 + 3 * share  # needs a shader of its own
    edit.lobe_1.gain = 1 - 0.8 * share  # an input inside the group
    edit.diffuse_saturation = 1 - share
    edit.blend = 0.5 * share
    scale.default_value = (1 + 4 * share, 1, 1, 1)  # a socket, of Blender alone


def insert_keys(material, scale, frame):
    edit = material.nfm.edit
    edit.lobe_2.keyframe_insert("width", frame=frame)
    edit.lobe_1.keyframe_insert("gain", frame=frame)
    edit.keyframe_insert("diffuse_saturation", frame=frame)
    edit.keyframe_insert("blend", frame=frame)
    scale.keyframe_insert("default_value", frame=frame)


def curves_of(material):
    for owner in (material, material.node_tree):
        for bag in owner.animation_data.action.layers[0].strips[0].channelbags:
            yield from bag.fcurves


@pytest.mark.parametrize("persistent", [False, True], ids=["fresh data", "persistent data"])
def test_frames_equal_stills(persistent, build, addon, sphere_scene, blender, tmp_path):
    module = addon("images")
    material, scale = build()
    for frame in (FRAMES, 1):
        set_values(material, scale, (frame - 1) / (FRAMES - 1))
        insert_keys(material, scale, frame)
    for curve in curves_of(material):
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"
    scene = sphere_scene(material, resolution=8, samples=1)
    scene.frame_end = FRAMES
    settings = scene.render
    settings.use_persistent_data = persistent
    settings.image_settings.file_format, settings.filepath = "OPEN_EXR", f"{tmp_path}/"
    settings.image_settings.color_depth = "32"
    blender.ops.render.render(animation=True, scene=scene.name)
    frames = {n: module.read_linear(tmp_path / f"{n:04d}.exr") for n in (1, 12, FRAMES)}

    still, scale = build()
    scene.objects["Sphere"].material_slots[0].material = still
    still.cycles.use_bump_map_correction = False
    settings.use_persistent_data = False
    for frame, pixels in frames.items():
        set_values(still, scale, (frame - 1) / (FRAMES - 1))
        settings.filepath = f"{tmp_path}/still.exr"
        blender.ops.render.render(write_still=True, scene=scene.name)
        expected = module.read_linear(tmp_path / "still.exr")
        np.testing.assert_allclose(pixels, expected, rtol=1e-4, atol=1e-5)
    assert np.abs(frames[1] - frames[12]).mean() > 0.01
    assert np.abs(frames[FRAMES] - frames[12]).mean() > 0.01
