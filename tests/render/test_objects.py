"""Objects that move, are instanced, turn their back, bend their normals or surround the camera."""

import numpy as np
import pytest

from fitter.models.tables import directional_albedo
from tests.models import MODELS
from tests.render import reference
from tests.render.samplings import SAMPLINGS
from tests.render.scenes import mean_and_noise

MODEL = MODELS["plastic"]
VIEW = 40
EXPECTED = directional_albedo(MODEL, np.radians([VIEW]))[0]

every_sampling = pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)


@pytest.fixture
def material(sampling, new_material):
    return new_material(MODEL, sampling.name)


def the_mesh(scene):
    return next(item for item in scene.objects if item.type == "MESH")


def check_mean(pixels, expected, sampling):
    mean, noise = mean_and_noise(pixels)
    assert (noise < 5e-3 * expected).all()
    assert (np.abs(mean - expected) < (1e-3 + sampling.error) * expected + 4 * noise).all()


@every_sampling
def test_motion_blur(sampling, material, stage, render):
    """The plane leaves the view while the shutter is open, halfway through."""
    scene = stage.tilted_plane(material, VIEW, samples=64)
    plane = the_mesh(scene)
    # its edge, 1 from its centre, goes from one side of the view to the other
    for frame, x in ((0, -0.5), (2, -1.5)):
        plane.location.x = x
        plane.keyframe_insert("location", index=0, frame=frame)
    scene.frame_set(1)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 2.0
    pixels = render(scene)
    # half of the time the white environment behind it
    np.testing.assert_allclose(pixels.mean((0, 1)), (1 + EXPECTED) / 2, atol=4e-3 + sampling.error)


@every_sampling
def test_an_instance_gives_the_same_pixels(sampling, material, stage, blender, render):
    scene = stage.tilted_plane(material, VIEW, samples=16)
    expected = render(scene)
    plane = the_mesh(scene)
    plane.rotation_euler = (0, 0, 0)
    scene.collection.objects.unlink(plane)
    collection = blender.data.collections.new("Plane")
    collection.objects.link(plane)
    empty = stage.add(scene, "Instance", None)
    empty.instance_type = "COLLECTION"
    empty.instance_collection = collection
    assert (render(scene) == expected).all()

    modifier_scene = stage.tilted_plane(material, VIEW, samples=16)
    host = the_mesh(modifier_scene)
    nodes = blender.data.node_groups.new("Instance", "GeometryNodeTree")
    nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    info = nodes.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = plane
    info.inputs["As Instance"].default_value = True
    exit_ = nodes.nodes.new("NodeGroupOutput")
    nodes.links.new(info.outputs["Geometry"], exit_.inputs["Geometry"])
    host.modifiers.new("Instance", "NODES").node_group = nodes
    assert (render(modifier_scene) == expected).all()


@every_sampling
def test_linked_duplicates_look_alike(sampling, material, stage, render):
    """Far from each other, turned and scaled."""
    scene = stage.tilted_plane(material, VIEW, samples=64)
    plane, camera = the_mesh(scene), scene.camera
    first = render(scene)
    other = stage.add(scene, "Duplicate", plane.data, (70, -30, 5))
    other.rotation_euler.z = 1.0
    other.scale = (2, 2, 2)
    camera.location = np.array(camera.location) + np.array(other.location)
    second = render(scene)
    check_mean(first, EXPECTED, sampling)
    check_mean(second, EXPECTED, sampling)


@every_sampling
def test_a_back_face_looks_like_the_front(sampling, material, stage, render):
    """As with every BSDF of Cycles, which turns the normal towards the viewer."""
    pixels = render(stage.tilted_plane(material, 180 - VIEW, samples=64))
    check_mean(pixels, EXPECTED, sampling)


@every_sampling
def test_a_normal_map_turns_the_frame(sampling, material, stage, blender, render):
    """Light directions below the true surface are lost, all others count."""
    tilt = np.radians(25)
    normal = np.array([np.sin(tilt), 0, np.cos(tilt)])
    tree = material.node_tree
    group = next(node for node in tree.nodes if node.type == "GROUP")
    normal_map = tree.nodes.new("ShaderNodeNormalMap")
    normal_map.space = "WORLD"
    normal_map.inputs["Color"].default_value = (*(normal / 2 + 0.5), 1)
    tree.links.new(normal_map.outputs["Normal"], group.inputs["Normal"])
    material.cycles.use_bump_map_correction = False
    pixels = render(stage.tilted_plane(material, VIEW, samples=64))

    theta = np.radians(VIEW)
    view = np.array([0, -np.sin(theta), np.cos(theta)])
    frame = np.broadcast_to(reference.frames(normal[None]), (800_000, 3, 3))
    wi, weight, above = reference.scatter(MODEL, frame, view, np.random.default_rng(0))
    samples = weight * (above & (wi[:, 2] > 0))[:, None]
    expected, error = samples.mean(0), samples.std(0) / np.sqrt(len(samples))
    assert (error < 0.01 * expected).all()
    mean, noise = mean_and_noise(pixels)
    tolerance = (2e-3 + sampling.error) * expected + 4 * np.hypot(noise, error)
    assert (np.abs(mean - expected) < tolerance).all()
    # a shader without the normal would show something else
    assert (np.abs(expected - EXPECTED) > 1.5 * tolerance).any()


@every_sampling
def test_zero_normal_is_no_normal(sampling, material, stage, render):
    """Such as from an attribute that the mesh does not have."""
    tree = material.node_tree
    group = next(node for node in tree.nodes if node.type == "GROUP")
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "missing"
    tree.links.new(attribute.outputs["Vector"], group.inputs["Normal"])
    check_mean(render(stage.tilted_plane(material, VIEW, samples=64)), EXPECTED, sampling)


@every_sampling
@pytest.mark.parametrize("name", ["plastic", "metal", "velvet"])
def test_light_from_below_is_black(name, sampling, stage, new_material, render):
    """Whatever the facet: a sun behind it, up to the horizon, and nothing else."""
    rng = np.random.default_rng(0)
    sun = np.array([1.0, 0, 0])
    normals = rng.normal(size=(16, 16, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[..., 2] = np.abs(normals[..., 2]) + 0.01
    normals[..., 0] = -np.abs(normals[..., 0]) - 1e-4
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    material = new_material(MODELS[name], sampling.name)
    scene = stage.facets(material, normals, samples=4)
    stage.sun(scene, sun)
    assert (render(scene) == 0).all()


@every_sampling
@pytest.mark.parametrize("name", ["plastic", "metal", "velvet"])
def test_camera_inside_a_closed_mesh(name, sampling, stage, blender, new_material, render):
    scene = stage.scene((16, 16), samples=16)
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    stage.mesh(scene, new_material(MODELS[name], sampling.name), corners, faces)
    camera = stage.add(scene, "Camera", blender.data.cameras.new("Camera"), (0.1, 0.2, 0.3))
    scene.camera = camera
    assert (render(scene) == 0).all()
    lamp = blender.data.lights.new("Lamp", "POINT")
    lamp.shadow_soft_size = 0.2
    stage.add(scene, "Lamp", lamp, (-0.4, -0.3, 0.2))
    pixels = render(scene)
    assert np.isfinite(pixels).all()
    assert pixels.mean() > 0
    # a residual is drawn with either sign
    assert (pixels >= 0).all() or sampling.name in ("SMOOTH", "EXACT")
