"""The scene of demo.blend, and the file itself as it is shipped."""

import re

import numpy as np
import pytest

from runner.environment import CHECKOUT

DEMO = CHECKOUT / "demo.blend"

# Opens a file, renders it small to an EXR for each seed and prints what happened to it.
RENDER = """
path, picture, *seeds = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=path)
scene = bpy.context.scene
scene.render.resolution_percentage, scene.cycles.samples = 5, 2
scene.cycles.use_denoising = False
# with several, two runs have been seen to differ, once
scene.render.threads_mode, scene.render.threads = "FIXED", 1
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
for seed in seeds:
    scene.cycles.seed = int(seed)
    scene.render.filepath = f"{picture}{seed}.exr"
    bpy.ops.render.render(write_still=True)
print("enabled", [key for key in bpy.context.preferences.addons.keys() if "nfm" in key])
sys.stdout.flush()
import os; os._exit(0)
"""


def shape(data):
    """Objects with their places and materials, as far as the code decides them."""
    return sorted(
        (
            item.name,
            tuple(round(number, 4) for row in item.matrix_basis for number in row),
            [slot.material.name for slot in item.material_slots],
        )
        for item in data.objects
    )


def script_nodes(data):
    return [
        node
        for group in data.node_groups
        for node in group.nodes
        if node.bl_idname == "ShaderNodeScript"
    ]


def test_the_scene_is_that_of_the_shipped_file(addon, blender, render):
    scene = addon("demo.scene").build_scene()
    built = shape(blender.data)
    materials = {m.name: m for m in blender.data.materials if m.nfm.parameters}
    assert len(materials) >= 6 + 3
    numbers = {name: m.nfm.numbers for name, m in materials.items()}
    assert sum(number == 2010 for number in numbers.values()) >= 2
    find = addon("node_group").find_group_node
    assert len({find(material).node_tree.name for material in materials.values()}) == 8

    woven = [item for item in scene.objects if item.name.startswith("Cloth")]
    nodes = [find(item.material_slots[0].material) for item in woven]
    assert [node.inputs["Rotation"].default_value for node in nodes] == [0, 45, 90]
    assert len({item.data.name for item in woven}) == 1

    scene.render.resolution_percentage, scene.cycles.samples = 5, 2
    scene.cycles.use_denoising = False
    pixels = render(scene)
    assert pixels.shape == (27, 48, 3)
    assert np.isfinite(pixels).all()
    assert 0.02 < pixels.mean() < 1

    blender.ops.wm.open_mainfile(filepath=str(DEMO))
    assert shape(blender.data) == built


def test_materials_of_the_shipped_file_are_up_to_date(addon, blender):
    """With the add-on nothing has to be compiled again, and sliders and curves are there."""
    blender.ops.wm.open_mainfile(filepath=str(DEMO))
    editing = addon("editing")
    before = {node.bytecode_hash for node in script_nodes(blender.data)}
    assert len(before) == len(script_nodes(blender.data)) == 8
    for material in editing.measured_materials():
        editing.refresh(material)
    assert {node.bytecode_hash for node in script_nodes(blender.data)} == before

    (edited,) = [m for m in blender.data.materials if "edited" in m.name]
    assert edited.nfm.edit.lobe_1.haze > 0
    document = editing.document_of(edited)
    assert [n for n, now in document.curves.items() if now != document.drawn[n]] == ["Lobe 2 D"]
    (blend,) = [m for m in blender.data.materials if "blended" in m.name]
    assert blend.nfm.edit.blend == 0.5
    assert "Copper" in blend.nfm.edit.blend_name


def test_the_shipped_file_needs_nothing_else(blender):
    assert DEMO.stat().st_size < 5e6
    blender.ops.wm.open_mainfile(filepath=str(DEMO))
    data = blender.data
    assert not list(data.libraries)
    assert all(image.packed_file or not image.filepath for image in data.images)
    assert all(text.is_in_memory for text in data.texts)
    assert all(node.bytecode and node.mode == "INTERNAL" for node in script_nodes(data))
    assert not blender.utils.blend_paths(absolute=False)
    (scene,) = data.scenes
    assert scene.camera
    assert scene.render.filepath.startswith("//")
    assert (scene.render.resolution_x, scene.render.resolution_y) == (960, 540)
    assert scene.cycles.samples == 128
    assert "blender -b demo.blend" in data.texts["About"].as_string()


def test_the_shipped_file_has_no_path_of_a_machine(blender):
    zstandard = pytest.importorskip("zstandard", reason="comes with bpy")
    with DEMO.open("rb") as file:
        content = zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True).read()
    assert content.startswith(b"BLENDER")
    assert not re.findall(rb"/(?:tmp|root|home|work|usr|var|Users)\b[^\0]{0,40}", content)
    assert not re.findall(rb"[A-Z]:\\\\[^\0]{0,40}", content)


def test_it_renders_the_same_without_the_add_on(addon, blender, run_python, tmp_path):
    answers = []
    for name, *seeds in (("a", 0), ("b", 0, 1)):
        answers.append(run_python(RENDER, DEMO, tmp_path / name, *seeds))
    assert all("enabled []" in answer for answer in answers)
    a, b, c = (addon("images").read_linear(tmp_path / f"{name}.exr") for name in ("a0", "b0", "b1"))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)
    assert 0.02 < a.mean() < 1

    blender.ops.wm.open_mainfile(filepath=str(DEMO))
    scene = blender.context.scene
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_percentage, scene.cycles.samples = 5, 2
    scene.cycles.use_denoising = False
    addon("rendering").render_to_file(scene, tmp_path / "d.exr")
    assert np.array_equal(addon("images").read_linear(tmp_path / "d.exr"), a)


@pytest.fixture
def tiny(addon, blender, monkeypatch):
    """A scene that takes no time, in place of the demo's."""
    module = addon("demo.scene")
    monkeypatch.setattr(module, "build_scene", lambda: blender.data.scenes.new("tiny"))
    return module


def test_only_what_both_versions_open_is_written(addon, blender, tiny, tmp_path, capfd):
    main = addon("command_line").main
    status = main(["demo", "--rebuild", "-o", str(tmp_path)])
    out, err = capfd.readouterr()
    path = tmp_path / "demo.blend"
    if blender.app.version >= (5, 0, 0):
        assert status == 1
        assert err.startswith("nfm: demo.blend: has to be written by Blender 4.5")
        assert err.count("\n") == 1
        assert not list(tmp_path.iterdir())
    else:
        assert status == 0
        assert out.endswith(f"written to      {path}, {path.stat().st_size / 1e6:.2f} MB\n")
        assert [item.name for item in tmp_path.iterdir()] == ["demo.blend"]
        blender.ops.wm.open_mainfile(filepath=str(path))
        assert [scene.name for scene in blender.data.scenes] == ["tiny"]


def test_a_folder_that_cannot_be_written(addon, blender, tiny, tmp_path, capfd):
    (tmp_path / "demo.blend").mkdir()
    assert addon("command_line").main(["demo", "--rebuild", "-o", str(tmp_path)]) == 1
    assert capfd.readouterr().err.startswith("nfm: demo.blend: ")
    assert [item.name for item in tmp_path.iterdir()] == ["demo.blend"]
