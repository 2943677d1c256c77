"""From where the azimuths of an anisotropic material count.

Pictures of the same seed and tables draw the same numbers: equal frames give equal pictures, but
for the few samples that rounding sends elsewhere.
"""

from dataclasses import replace

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS

MODEL = ANISOTROPIC_MODELS["brushed"]
STEPS = 4
ROTATION = 7.5 * STEPS
TURNED = replace(
    MODEL,
    ndf=np.roll(MODEL.ndf, STEPS, axis=2),
    masking=np.roll(MODEL.masking, STEPS, axis=2),
)

# Pictures by how they were taken: to compile the shader is what costs.
TAKEN = {}


@pytest.fixture
def light(addon, tmp_path):
    path = tmp_path / "light.exr"
    addon("images").write_linear(path, addon("demo_light").studio())
    return path


@pytest.fixture
def picture(addon, sphere, new_material, render, light):
    """Sphere of a model; inputs of its node by name, and what to do to its mesh."""

    def show(
        model,
        inputs=None,
        prepare=None,
        resolution=32,
        samples=16,
        sampling="REFERENCE",
    ):
        how = (model is MODEL, str(inputs), prepare, resolution, samples, sampling)
        if how not in TAKEN:
            TAKEN[how] = render(
                scene_of(model, inputs or {}, prepare, resolution, samples, sampling)
            )
        return TAKEN[how]

    def scene_of(model, inputs, prepare, resolution, samples, sampling):
        material = new_material(model, sampling)
        for name, value in inputs.items():
            addon("material").find_group_node(material).inputs[name].default_value = value
        view = sphere.SphereView(resolution, samples, environment=light)
        scene = sphere.build_scene(material, view)
        if prepare:
            prepare(next(item for item in scene.objects if item.type == "MESH").data)
        return scene

    return show


def differing(a, b):
    return np.abs(a - b).sum() / b.sum()


def along_meridians(mesh):
    """UV coordinates whose U rises with z."""
    layer = mesh.uv_layers.new()
    heights = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", heights)
    x, y, z = heights.reshape(-1, 3)[[loop.vertex_index for loop in mesh.loops]].T
    uv = np.stack([np.arcsin(np.clip(z, -1, 1)), -np.arctan2(y, x)], -1)
    layer.data.foreach_set("uv", uv.ravel())


def test_rotation_turns_counter_clockwise(picture):
    """The turned tables draw other directions, so that noise makes these pictures differ too."""
    clean = {"resolution": 12, "samples": 1024}
    expected = picture(TURNED, **clean)
    turned, turned_back, unturned = (
        differing(picture(MODEL, {"Rotation": angle}, **clean), expected)
        for angle in (ROTATION, -ROTATION, 0.0)
    )
    assert turned < 0.5 * min(turned_back, unturned)


def test_full_turn_changes_nothing(picture):
    assert differing(picture(MODEL, {"Rotation": 360.0}), picture(MODEL)) < 1e-3


def test_tangent_socket(picture):
    """On the sphere, +Z within the surface is a quarter turn from increasing longitude."""
    north = picture(MODEL, {"Tangent": (0, 0, 2)})
    assert differing(north, picture(MODEL, {"Rotation": 90.0})) < 0.02
    assert differing(north, picture(MODEL)) > 0.05


def test_uv_map_gives_the_tangent(picture):
    by_uv = picture(MODEL, prepare=along_meridians)
    assert differing(by_uv, picture(MODEL, {"Rotation": 90.0})) < 0.02
    assert differing(by_uv, picture(MODEL)) > 0.05


def test_native_is_the_sampling_by_default(addon):
    """As for isotropic materials, and its error is known."""
    material = addon("material").build(FittedMaterial("test", MODEL))
    assert material.nfm.sampling == "NATIVE"
    assert 0 < material.nfm.native_error < 0.02
    assert material.nfm.native_psnr > 40
    material.nfm.sampling = "EXACT"
    script = addon("material").find_script_node(material)
    assert script.inputs["Candidates"].default_value == 2


def test_native_turns_with_the_material(picture):
    """Base lobes have the frame of the factors, which exact sampling shows."""
    clean = {"resolution": 24, "samples": 256}
    expected = picture(MODEL, {"Rotation": ROTATION}, sampling="EXACT", **clean)
    native, other = (
        picture(MODEL, {"Rotation": angle}, sampling="NATIVE", **clean)
        for angle in (ROTATION, -ROTATION)
    )
    assert differing(native, expected) < 0.05
    assert differing(other, expected) > 0.1
