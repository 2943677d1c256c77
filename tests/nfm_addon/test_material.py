"""Material, node group, Script node and Text."""

import tempfile
from dataclasses import replace

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS

BROKEN_SHADER = "shader nfm_surface(output closure color BSDF = 0) { this is not OSL }"

HOSTILE_NAMES = [
    '"); } shader evil() {}',
    "*/ #include </etc/passwd>",
    "two\nlines\r\nand a tab\t",
    "$ndf ${scale} %s {0} \\n \\",
    "../../../outside",
    "\u202egnp.kcalb\u202c \N{SNOWMAN}",
    "n" * 1024,
    "",
]


@pytest.fixture
def build(addon, fitted):
    def make(model=None, sampling="REFERENCE", name=None):
        if model is not None or name is not None:
            fresh = FittedMaterial("test" if name is None else name, model or fitted.model)
            return addon("material").build(fresh, sampling)
        return addon("material").build(fitted, sampling)

    return make


@pytest.fixture
def script_of(addon):
    return addon("material").find_script_node


@pytest.fixture
def errors(addon):
    return addon("errors")


def group_node(material):
    return material.node_tree.nodes["NFM BRDF"]


# ---- what is built ----


def test_sockets_of_the_group(build, fitted):
    node = group_node(build())
    assert [(socket.name, socket.type) for socket in node.inputs] == [
        ("Diffuse", "RGBA"),
        ("Lobe 1 Scale", "RGBA"),
        ("Lobe 2 Scale", "RGBA"),
        ("Lobe 3 Scale", "RGBA"),
        ("Normal", "VECTOR"),
    ]
    assert [(socket.name, socket.type) for socket in node.outputs] == [
        ("BSDF", "SHADER"),
        ("Stand-in", "SHADER"),
    ]
    diffuse, *lobes, normal = node.inputs
    np.testing.assert_allclose(diffuse.default_value[:3], np.pi * fitted.model.diffuse, rtol=1e-6)
    assert diffuse.default_value[3] == 1
    for lobe in lobes:
        assert tuple(lobe.default_value) == (1, 1, 1, 1)
    assert tuple(normal.default_value) == (0, 0, 0)
    assert normal.hide_value


@pytest.mark.osl
def test_script_node_inside_the_group(build, script_of):
    script = script_of(build())
    assert {socket.name: socket.is_linked for socket in script.inputs} == {
        "Diffuse": True,
        "Lobe 1 Scale": True,
        "Lobe 2 Scale": True,
        "Lobe 3 Scale": True,
        "Normal": True,
        "Candidates": False,
        "Light Direction": False,
        "View Direction": False,
    }
    assert {socket.name: socket.is_linked for socket in script.outputs} == {
        "Value": False,
        "BSDF": True,
    }
    for socket in (*script.inputs, *script.outputs):
        assert socket.hide != socket.is_linked
    assert script.inputs["Candidates"].default_value == 4
    assert script.mode == "INTERNAL"
    assert script.bytecode


@pytest.mark.osl
def test_every_engine_has_an_output_of_its_own(build):
    material = build()
    tree = material.node_tree
    outputs = {target: tree.get_output_node(target) for target in ("CYCLES", "EEVEE")}
    sockets = {t: out.inputs["Surface"].links[0].from_socket for t, out in outputs.items()}
    assert {target: socket.name for target, socket in sockets.items()} == {
        "CYCLES": "BSDF",
        "EEVEE": "Stand-in",
    }
    assert {socket.node for socket in sockets.values()} == {group_node(material)}


@pytest.mark.osl
@pytest.mark.parametrize("name", HOSTILE_NAMES, ids=ascii)
def test_name_does_not_reach_the_shader(name, build, script_of):
    plain, hostile = build(name="plain"), build(name=name)
    assert script_of(hostile).script.as_string() == script_of(plain).script.as_string()
    assert script_of(hostile).bytecode
    # nor does a later one
    plain.nfm.sampling = "COSINE"
    hostile.name = name[::-1] + '"\n'
    hostile.nfm.sampling = "COSINE"
    assert script_of(hostile).script.as_string() == script_of(plain).script.as_string()
    assert "cos_i / pi" in script_of(plain).script.as_string()


# ---- errors ----


@pytest.mark.osl
def test_failed_compilation_leaves_nothing(addon, build, errors, all_names, monkeypatch, tmp_path):
    monkeypatch.setattr(
        addon("material"),
        "new_surface",
        lambda *_, **__: addon("shader_source").Surface(BROKEN_SHADER, None),
    )
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = all_names()
    with pytest.raises(errors.ShaderError, match=r"could not compile .*'test\.osl'; see the con"):
        build(MODELS["matte"])
    assert all_names() == before
    assert list(tmp_path.iterdir()) == []


def shown_in_cycles(material):
    return material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_socket.name


@pytest.mark.osl
def test_without_osl_there_is_the_stand_in_until_there_is(
    build, script_of, addon, monkeypatch, blender, tmp_path
):
    import _cycles

    with monkeypatch.context() as patch:
        patch.setattr(_cycles, "with_osl", False)
        material = build()
        assert script_of(material).bytecode == ""
        assert shown_in_cycles(material) == "Stand-in"
        material.nfm.sampling = "EXACT"
        path = str(tmp_path / "made.blend")
        material.use_fake_user = True
        blender.ops.wm.save_as_mainfile(filepath=path)
    blender.ops.wm.open_mainfile(filepath=path)
    (material,) = blender.data.materials
    assert script_of(material).bytecode
    assert script_of(material).outputs["BSDF"].is_linked
    assert shown_in_cycles(material) == "BSDF"
    assert "candidate" in script_of(material).script.as_string()


def test_what_needs_osl_says_so(addon, errors, monkeypatch):
    import _cycles

    monkeypatch.setattr(_cycles, "with_osl", False)
    with pytest.raises(errors.ShaderError, match="built without Open Shading Language"):
        addon("evaluate").evaluate_through_osl(MODELS["matte"], np.zeros((0, 3)), np.zeros((0, 3)))


def test_find_script_node_in_a_material_without_nodes(blender, script_of, errors):
    plain = blender.data.materials.new("plain")
    with pytest.raises(errors.ShaderError, match="material 'plain' has no NFM BRDF node any more"):
        script_of(plain)


@pytest.mark.parametrize("damage", ["group removed", "group emptied", "script removed"])
def test_find_script_node_in_a_damaged_material(damage, build, script_of, errors):
    material = build()
    node = group_node(material)
    if damage == "group removed":
        material.node_tree.nodes.remove(node)
    elif damage == "group emptied":
        node.node_tree = None
    else:
        node.node_tree.nodes.remove(script_of(material))
    with pytest.raises(errors.ShaderError, match="import it again"):
        script_of(material)


def test_find_script_node_passes_by_other_groups(blender, build, script_of):
    material = build()
    expected = script_of(material)
    nodes = material.node_tree.nodes
    other = blender.data.node_groups.new("Other", "ShaderNodeTree")
    for tree in (other, None):
        nodes.new("ShaderNodeGroup").node_tree = tree
    ours = nodes.new("ShaderNodeGroup")
    ours.node_tree = expected.id_data
    nodes.remove(group_node(material))
    assert script_of(material) == expected


@pytest.mark.parametrize("parameters", ["", "{", '{"format": "nfm"}', "[]"])
def test_damaged_parameters_leave_the_shader(parameters, addon, build, script_of, errors):
    material = build()
    script = script_of(material)
    before = (script.script.as_string(), script.bytecode, len(script.inputs))
    material.nfm.parameters = parameters
    with pytest.raises(errors.NfmError, match=r"^material 'blue plastic': "):
        addon("editing").refresh(material)
    assert (script.script.as_string(), script.bytecode, len(script.inputs)) == before


def test_damaged_parameters_do_not_break_the_property(build, script_of, capfd):
    material = build()
    before = script_of(material).bytecode
    material.nfm.parameters = "{"
    material.nfm.sampling = "COSINE"
    assert "nfm: material 'blue plastic': not valid JSON" in capfd.readouterr().out
    assert script_of(material).bytecode == before


@pytest.mark.osl
def test_failed_update_leaves_the_shader(addon, build, script_of, errors, monkeypatch):
    material = build()
    script = script_of(material)
    before = (script.script.as_string(), script.bytecode, script.bytecode_hash)
    links = len(script.id_data.links)
    monkeypatch.setattr(
        addon("editing.shader"),
        "new_surface",
        lambda *_, **__: addon("shader_source").Surface(BROKEN_SHADER, None),
    )
    material.nfm.edit.edge_strength = 2
    with pytest.raises(errors.ShaderError):
        addon("editing").refresh(material)
    assert (script.script.as_string(), script.bytecode, script.bytecode_hash) == before
    assert len(script.id_data.links) == links


# ---- changes ----


@pytest.mark.osl
def test_sampling_writes_the_shader_anew(build, script_of):
    material = build()
    script = script_of(material)
    source, bytecode, key = script.script.as_string(), script.bytecode, script.bytecode_hash
    material.nfm.sampling = "COSINE"
    assert script_of(material) == script
    assert " sample_half_vector(u," in source
    assert " sample_half_vector(u," not in script.script.as_string()
    assert script.bytecode != bytecode
    assert script.bytecode_hash != key
    material.nfm.sampling = "REFERENCE"
    assert script.script.as_string() == source


@pytest.mark.osl
def test_sampling_keeps_values_and_links(blender, build, script_of):
    material = build()
    node, script = group_node(material), script_of(material)
    node.inputs["Diffuse"].default_value = (0.1, 0.2, 0.3, 1)
    node.inputs["Lobe 2 Scale"].default_value = (2, 1, 0.5, 1)
    tree = material.node_tree
    color = tree.nodes.new("ShaderNodeRGB")
    tree.links.new(color.outputs[0], node.inputs["Lobe 1 Scale"])
    texts = len(blender.data.texts)

    material.nfm.sampling = "COSINE"
    assert tuple(node.inputs["Diffuse"].default_value) == pytest.approx((0.1, 0.2, 0.3, 1))
    assert tuple(node.inputs["Lobe 2 Scale"].default_value) == (2, 1, 0.5, 1)
    assert node.inputs["Lobe 1 Scale"].links[0].from_node == color
    linked = [socket.name for socket in script.inputs if socket.is_linked]
    assert linked == ["Diffuse", "Lobe 1 Scale", "Lobe 2 Scale", "Lobe 3 Scale", "Normal"]
    assert script.outputs["BSDF"].is_linked
    assert len(blender.data.texts) == texts


@pytest.mark.osl
@pytest.mark.parametrize(
    ("sampling", "candidates"),
    [("NATIVE", 0), ("SMOOTH", 2), ("EXACT", 2), ("REFERENCE", 4), ("COSINE", 1)],
)
def test_candidates_are_those_of_the_sampling(sampling, candidates, build, script_of):
    """A number that suits one sampling, the user's own too, means something else in another."""
    material = build(sampling="COSINE")
    socket = script_of(material).inputs["Candidates"]
    socket.default_value = 7
    material.nfm.sampling = sampling
    assert script_of(material).inputs["Candidates"].default_value == candidates
    # a new material has the same
    fresh = build(sampling=sampling)
    assert script_of(fresh).inputs["Candidates"].default_value == candidates
    assert script_of(fresh).script.as_string() == script_of(material).script.as_string()


@pytest.mark.osl
def test_writing_the_shader_anew_keeps_candidates(addon, build, script_of):
    material = build(sampling="EXACT")
    script_of(material).inputs["Candidates"].default_value = 7
    material.nfm.edit.edge_strength = 2
    assert addon("editing").refresh(material)
    assert script_of(material).inputs["Candidates"].default_value == 7


@pytest.mark.osl
def test_failed_change_of_sampling_leaves_candidates(addon, build, script_of, monkeypatch, capfd):
    material = build(sampling="EXACT")
    script_of(material).inputs["Candidates"].default_value = 7
    surface = addon("shader_source").Surface(BROKEN_SHADER, None)
    monkeypatch.setattr(addon("editing.shader"), "new_surface", lambda *_, **__: surface)
    material.nfm.sampling = "REFERENCE"
    assert script_of(material).inputs["Candidates"].default_value == 7
    assert "nfm: Cycles could not compile" in capfd.readouterr().out


@pytest.mark.parametrize("sampling", ["NATIVE", "SMOOTH", "EXACT"])
def test_error_of_the_base_is_told(sampling, build, native_error):
    assert 0 < native_error.image < 0.01
    built, changed = build(sampling=sampling), build(sampling="REFERENCE")
    assert changed.nfm.native_error == changed.nfm.native_psnr == 0
    changed.nfm.sampling = sampling
    for material in (built, changed):
        assert material.nfm.native_error == pytest.approx(native_error.image, rel=1e-6)
        assert material.nfm.native_psnr == pytest.approx(native_error.psnr, rel=1e-6)
    # it is of the model, and remains true
    changed.nfm.sampling = "COSINE"
    assert changed.nfm.native_error == pytest.approx(native_error.image, rel=1e-6)


def test_error_of_a_black_material_is_a_number(build):
    model = MODELS["matte"]
    black = build(replace(model, diffuse=np.zeros(3), scale=np.zeros((3, 3))), "NATIVE")
    assert (black.nfm.native_error, black.nfm.native_psnr) == (0, 200)


def test_sampling_of_other_materials_is_nobody_s_business(blender):
    material = blender.data.materials.new("plain")
    material.nfm.sampling = "COSINE"
    assert material.nfm.sampling == "COSINE"


# ---- what is rendered ----


@pytest.mark.osl
def test_sampling_changes_the_noise_and_not_the_mean(build, render, sphere_scene):
    material = build(MODELS["matte"])
    pictures = [render(sphere_scene(material, samples=64))]
    material.nfm.sampling = "COSINE"
    pictures.append(render(sphere_scene(material, samples=64)))
    assert (pictures[0] != pictures[1]).any()
    assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=5e-3)


@pytest.mark.osl
def test_mixed_in_the_tree_of_another_material(blender, addon, build, render, sphere_scene):
    """Two groups under a Mix Shader, as a layer; edits of their own materials are seen there."""
    parts = [build(MODELS[name], "NATIVE") for name in ("matte", "plastic")]
    layered = blender.data.materials.new("layered")
    tree = addon("node_trees").empty_tree(layered)
    mix, output = (
        tree.nodes.new(kind) for kind in ("ShaderNodeMixShader", "ShaderNodeOutputMaterial")
    )
    mix.inputs["Fac"].default_value = 0.25
    tree.links.new(mix.outputs["Shader"], output.inputs["Surface"])
    for socket, part in zip(mix.inputs[1:], parts, strict=True):
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group_node(part).node_tree
        tree.links.new(node.outputs["BSDF"], socket)
    first, second, both = (render(sphere_scene(item, samples=64)) for item in (*parts, layered))
    expected = 0.75 * first + 0.25 * second
    assert both.mean() == pytest.approx(expected.mean(), rel=0.01)
    for lobe in ("lobe_1", "lobe_2", "lobe_3"):
        getattr(parts[1].nfm.edit, lobe).gain = 0.0
    darker = render(sphere_scene(layered, samples=64))
    assert darker.mean() < both.mean()


def test_several_users_see_the_same_edit(blender, build, addon):
    item = build()
    users = [blender.data.objects.new(name, blender.data.meshes.new(name)) for name in "AB"]
    for user in users:
        user.data.materials.append(item)
    item.nfm.edit.lobe_1.width = 2.0
    addon("live").flush()
    assert [user.active_material for user in users] == [item, item]
    assert len([group for group in blender.data.node_groups if group.name == "NFM BRDF"]) == 1


@pytest.mark.osl
def test_normal_is_that_of_the_geometry_unless_linked(build, render, sphere_scene):
    material = build()
    scene = sphere_scene(material)
    unlinked = render(scene)
    tree = material.node_tree
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(geometry.outputs["Normal"], group_node(material).inputs["Normal"])
    np.testing.assert_allclose(render(scene), unlinked, rtol=1e-3)
    # a vector of no direction counts as unlinked; a constant one Cycles would drop
    zero = tree.nodes.new("ShaderNodeAttribute")
    zero.attribute_name = "there is none"
    tree.links.new(zero.outputs["Vector"], group_node(material).inputs["Normal"])
    np.testing.assert_allclose(render(scene), unlinked, rtol=1e-3)


@pytest.mark.parametrize("color", [(0.9, 0.2, 0.6, 1), (0.5, 0.5, 0.5, 1), (0, 1, 0, 1)])
@pytest.mark.parametrize("sampling", ["NATIVE", "REFERENCE", "COSINE"])
def test_normal_map_changes_the_picture(color, sampling, build, render, sphere_scene):
    material = build(MODELS["metal"], sampling)
    scene = sphere_scene(material, samples=16)
    before = render(scene)
    tree = material.node_tree
    bumps = tree.nodes.new("ShaderNodeNormalMap")
    bumps.space = "WORLD"  # needs no UV map
    bumps.inputs["Color"].default_value = color
    tree.links.new(bumps.outputs["Normal"], group_node(material).inputs["Normal"])
    pixels = render(scene)
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()
    if color == (0.5, 0.5, 0.5, 1):
        return  # no direction at all: Blender or the shader falls back to the geometry
    assert np.abs(pixels - before).mean() > 0.01


# ---- saved files ----


@pytest.fixture
def saved(blender, build, render, sphere_scene, tmp_path):
    """A .blend with the material on the standard sphere, and its picture."""
    pixels = render(sphere_scene(build()))
    assert pixels.std() > 0.01
    path = tmp_path / "saved.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    return path, pixels


@pytest.mark.osl
def test_reopened_file_renders_the_same(blender, saved, render, script_of, fitted):
    path, pixels = saved
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert "NFM Standard Sphere" not in blender.data.scenes
    blender.ops.wm.open_mainfile(filepath=str(path))
    np.testing.assert_array_equal(render(blender.data.scenes["NFM Standard Sphere"]), pixels)
    material = blender.data.materials["blue plastic"]
    assert material.nfm.source == "blue.binary"
    assert material.nfm.sampling == "REFERENCE"
    assert material.nfm.iterations == 57
    # the extension goes on working with it
    before = script_of(material).bytecode
    material.nfm.sampling = "COSINE"
    assert script_of(material).bytecode != before


RENDER_WITHOUT_EXTENSION = """
assert not [name for name in sys.modules if "nfm" in name]
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
assert not hasattr(bpy.types.Material, "nfm")
scene = bpy.data.scenes["NFM Standard Sphere"]
scene.render.filepath = sys.argv[2]
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
bpy.ops.render.render(write_still=True, scene=scene.name)
"""


@pytest.mark.osl
def test_file_renders_the_same_without_the_extension(saved, addon, run_python, tmp_path):
    path, pixels = saved
    picture = tmp_path / "without.exr"
    run_python(RENDER_WITHOUT_EXTENSION, path, picture)
    np.testing.assert_array_equal(addon("images").read_linear(picture), pixels)
