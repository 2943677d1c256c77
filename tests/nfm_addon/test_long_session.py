# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does a hundred times a day leaves nothing behind.

./nfm bench session does more of it, with models of their own, and counts the memory.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.models.tables import directional_albedo
from tests.models import MODELS
from tests.render.scenes import Stage

TIMES = 20
STEPS = 100


@pytest.fixture
def forget(blender):
    """Delete what is selected and purge what nobody uses, as File > Clean Up does."""

    def run():
        for item in [*blender.data.objects]:
            blender.data.objects.remove(item)
        for item in [*blender.data.materials]:
            blender.data.materials.remove(item)
        blender.ops.outliner.orphans_purge(do_local_ids=True, do_linked_ids=True, do_recursive=True)

    return run


def test_imports_and_deletions_leave_no_datablock(
    blender, all_names, parameter_path, mesh_object, forget
):
    before = all_names()
    for _ in range(TIMES):
        mesh_object()
        assert blender.ops.nfm.import_measurement(filepath=str(parameter_path)) == {"FINISHED"}
        during = {kind: names for kind, names in all_names().items() if names != before[kind]}
        assert all(len(names) == len(before[kind]) + 1 for kind, names in during.items()), during
        assert {"materials", "node_groups", "texts"} <= during.keys()
        forget()
        assert all_names() == before


def test_saved_and_loaded_again_and_again(addon, blender, fitted, tmp_path):
    """Neither the file nor what is in it grows, and the shader stays as it was."""
    path = str(tmp_path / "scene.blend")
    material = addon("material").build(fitted)
    material.use_fake_user = True
    source = addon("material").find_script_node(material).script.as_string()
    names, sizes = [], []
    for _ in range(STEPS):
        blender.ops.wm.save_as_mainfile(filepath=path, check_existing=False)
        blender.ops.wm.open_mainfile(filepath=path, load_ui=False)
        sizes.append((tmp_path / "scene.blend").stat().st_size)
        names.append(
            [[i.name for i in kind] for kind in (blender.data.materials, blender.data.node_groups)]
        )
    assert names[0] == names[-1]
    assert max(sizes[1:]) - min(sizes[1:]) < 4096, sizes
    (material,) = blender.data.materials
    assert addon("material").find_script_node(material).script.as_string() == source
    assert addon("editing").refresh(material) is False, "an opened file was taken for an edited one"


def test_undone_and_redone_again_and_again(addon, blender, fitted, undo_steps):
    """Through a hundred edits and back: each state has the shader of its sliders."""
    edits, live = 4, addon("live")
    material = addon("material").build(fitted)
    material.use_fake_user = True
    blender.ops.ed.undo_push(message="built")
    sources = [_source(addon, material)]
    for number in range(1, edits + 1):
        material.nfm.edit.lobe_1.width = 1 + number
        live.flush()
        blender.ops.ed.undo_push(message=f"width {number}")
        sources.append(_source(addon, material))
    assert all(a != b for a, b in pairwise(sources))
    datablocks = len(blender.data.user_map())
    for _ in range(STEPS // (2 * edits) + 1):
        for numbers, step in ((range(edits - 1, -1, -1), "undo"), (range(1, edits + 1), "redo")):
            for number in numbers:
                assert getattr(blender.ops.ed, step)() == {"FINISHED"}
                live.flush()
                material = blender.data.materials["blue plastic"]
                assert material.nfm.edit.lobe_1.width == (1 + number if number else 1)
                assert _source(addon, material) == sources[number]
    assert len(blender.data.user_map()) == datablocks


def test_two_materials_edited_alternately(addon, blender):
    """Neither takes anything from the other."""
    build, live = addon("material").build, addon("live")
    pair = [build(FittedMaterial(name, MODELS[name])) for name in ("plastic", "velvet")]
    alone = [build(FittedMaterial(name, MODELS[name])) for name in ("plastic", "velvet")]
    for number in range(10):
        for item in (pair[number % 2], alone[number % 2]):
            item.nfm.edit.lobe_1.width = 1 + number / 10
            item.nfm.edit.lobe_2.gain = 1 + number / 20
        live.flush()
    for together, apart in zip(pair, alone, strict=True):
        assert _source(addon, together) == _source(addon, apart)
    assert _source(addon, pair[0]) != _source(addon, pair[1])


@pytest.mark.osl
def test_a_scene_of_many_materials(addon, blender, render):
    """Each object shows its own: the mean of a facet is the albedo of its model."""
    side = 3
    stage = Stage(blender, addon)
    scene = stage.scene((8 * side, 8 * side), samples=64, light=1.0)
    model = MODELS["matte"]
    expected = []
    for number in range(side * side):
        x, y = number % side - (side - 1) / 2, (side - 1) / 2 - number // side
        diffuse = np.array([0.01, 0.02, 0.03]) * (1 + number)
        own = replace(model, diffuse=diffuse / np.pi)
        item = addon("material").build(FittedMaterial(f"material {number}", own))
        corners = [(x - 0.5, y - 0.5, 0), (x + 0.5, y - 0.5, 0)]
        corners += [(x + 0.5, y + 0.5, 0), (x - 0.5, y + 0.5, 0)]
        stage.mesh(scene, item, corners, [(0, 1, 2, 3)])
        expected.append(directional_albedo(own, np.zeros(1))[0])
    stage.camera(scene, side)
    found = render(scene).reshape(side, 8, side, 8, 3)[:, 2:6, :, 2:6].mean((1, 3)).reshape(-1, 3)
    np.testing.assert_allclose(found, expected, rtol=0.03)


def _source(addon, material):
    return addon("material").find_script_node(material).script.as_string()


def test_parameters_written_again_and_again_are_the_same(fitted, tmp_path):
    """No rounding creeps in."""
    path = tmp_path / "again.nfm.json"
    parameter_file.save(path, fitted)
    first = path.read_bytes()
    for _ in range(STEPS):
        parameter_file.save(path, parameter_file.load(path))
    assert path.read_bytes() == first
