"""Three cloths with one material at three rotations."""

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture
def cloth_scene(addon, monkeypatch):
    """The module, with a coarse cloth."""
    drape = addon("drape")
    for name, value in (("LEVELS", (9, 17)), ("STEPS", (40, 20)), ("PARTICLES", 17)):
        monkeypatch.setattr(drape, name, value)
    return addon("cloth_scene")


@pytest.fixture
def scene_of(addon, cloth_scene):
    """The scene of a model, 16 pixels high."""

    def build(model, samples=1):
        material = addon("material").build(FittedMaterial("test", model), "REFERENCE")
        view = addon("standard_sphere").SphereView(resolution=16, samples=samples)
        return material, cloth_scene.build_cloth_scene(material, view)

    return build


def rotations(addon, scene):
    cloths = [item for item in scene.objects if item.name.startswith("Cloth")]
    return [
        addon("node_group").find_group_node(item.material_slots[0].material).inputs["Rotation"]
        for item in sorted(cloths, key=lambda item: item.location.x)
    ]


def test_rotations_differ_and_the_mesh_is_one(addon, scene_of):
    material, scene = scene_of(ANISOTROPIC_MODELS["satin"])
    values = [socket.default_value for socket in rotations(addon, scene)]
    assert values == [0, 45, 90]
    cloths = [item for item in scene.objects if item.name.startswith("Cloth")]
    assert len({item.data.name for item in cloths}) == 1
    # the material itself is not touched, nor is its shader copied
    assert addon("node_group").find_group_node(material).inputs["Rotation"].default_value == 0
    groups = {
        addon("node_group").find_group_node(item.material_slots[0].material).node_tree.name
        for item in cloths
    }
    assert len(groups) == 1


def test_isotropic_materials_are_shown_too(scene_of):
    _, scene = scene_of(MODELS["matte"])
    assert len([item for item in scene.objects if item.name.startswith("Cloth")]) == 3


def test_mesh_has_its_uv(cloth_scene):
    mesh = cloth_scene.cloth_mesh()
    assert len(mesh.vertices) == 17 * 17
    assert len(mesh.polygons) == 16 * 16
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.data.foreach_get("uv", uv)
    uv = uv.reshape(-1, 4, 2)
    # faces keep their orientation in UV space: U and V do not change places anywhere
    a, b = uv[:, 1] - uv[:, 0], uv[:, 3] - uv[:, 0]
    assert (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0).all()
    normals = np.array([vertex.normal for vertex in mesh.vertices])
    outside = np.array([vertex.co for vertex in mesh.vertices])
    middle = normals.reshape(17, 17, 3)[8, 8]
    assert middle @ outside.reshape(17, 17, 3)[8, 8] > 0


def test_picture_is_three_times_as_wide(addon, scene_of, tmp_path):
    _, scene = scene_of(ANISOTROPIC_MODELS["brushed"], samples=8)
    path = tmp_path / "cloth.exr"
    addon("rendering").render_to_file(scene, path)
    pixels = addon("images").read_linear(path)
    assert pixels.shape == (16, 48, 3)
    # rotation shows: the three thirds are the same scene but for the perspective
    thirds = pixels.reshape(16, 3, 16, 3).mean((0, 2))
    assert np.ptp(thirds[:, 0]) > 1e-3 * thirds.mean()
