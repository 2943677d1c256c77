# SPDX-License-Identifier: GPL-3.0-or-later
"""When shaders are brought up to date. Timers do not run without a window; they are called here."""

from types import SimpleNamespace

import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS


@pytest.fixture
def live(addon):
    return addon("live")


@pytest.fixture
def requests(live, monkeypatch):
    """Counts the requests for a timer."""
    found = []
    monkeypatch.setattr(live, "request", lambda: found.append(1))
    return found


@pytest.fixture
def build(blender, addon):
    """A measured material on an object in the scene."""

    def make(name="plastic", sampling="REFERENCE"):
        material = addon("material").build(FittedMaterial(name, MODELS[name]), sampling)
        mesh = blender.data.meshes.new(name)
        mesh.materials.append(material)
        item = blender.data.objects.new(name, mesh)
        blender.context.scene.collection.objects.link(item)
        blender.context.view_layer.update()
        return material

    return make


@pytest.fixture
def source(addon):
    return lambda material: addon("material").find_script_node(material).script.as_string()


def drag(blender, group, name="Lobe 2 D"):
    mapping = group.nodes[name].mapping
    mapping.curves[0].points[3].location[1] -= 0.1
    mapping.update()
    group.update_tag()
    blender.context.view_layer.update()


def test_a_dragged_curve_asks_for_work(blender, addon, build, requests):
    material = build()
    requests.clear()
    drag(blender, addon("editing").group_of(material))
    assert requests


def test_a_curve_under_the_mouse_asks_for_work(blender, addon, build, live, requests, monkeypatch):
    """Blender tells of it when the button is released; until then its editor is drawn anew."""
    material = build()
    monkeypatch.setattr(live, "_shown_material", lambda _context: material)
    requests.clear()
    live._on_draw()
    assert not requests
    point = addon("editing").group_of(material).nodes["Lobe 2 D"].mapping.curves[0].points[3]
    point.location[1] -= 0.1
    live._on_draw()
    assert requests


def test_editors_without_a_measured_material_are_left_alone(blender, build, live, requests):
    plain = blender.data.materials.new("plain")
    for shown in (
        SimpleNamespace(material=plain, space_data=None),
        SimpleNamespace(space_data=SimpleNamespace(id=None)),
        SimpleNamespace(space_data=SimpleNamespace()),
        SimpleNamespace(material=None, space_data=SimpleNamespace(id=plain)),
    ):
        assert live._shown_material(shown) is None
    material = build()
    assert (
        live._shown_material(SimpleNamespace(space_data=SimpleNamespace(id=material))) == material
    )
    requests.clear()
    live._on_draw()
    assert not requests


def test_nothing_else_does(blender, addon, build, requests, monkeypatch):
    """500 objects that move: no material is even looked at."""
    material = build()
    plain = blender.data.materials.new("plain")
    things = []
    for number in range(500):
        item = blender.data.objects.new(f"empty {number}", None)
        blender.context.scene.collection.objects.link(item)
        things.append(item)
    blender.context.view_layer.update()
    requests.clear()
    looked_at = []
    monkeypatch.setattr(
        addon("editing"), "measured_materials", lambda: looked_at.append(1) or [material]
    )
    for step in range(3):
        for item in things:
            item.location.x += step + 1
        blender.context.view_layer.update()
    assert not looked_at
    # a plain material, or a scale, changes nothing either
    plain.roughness = 0.25
    blender.context.view_layer.update()
    node = addon("material").find_group_node(material)
    node.inputs["Lobe 1 Scale"].default_value = (2, 2, 2, 1)
    blender.context.view_layer.update()
    assert not requests


def test_work_itself_asks_for_none(blender, addon, build, live, requests):
    material = build()
    drag(blender, addon("editing").group_of(material))
    live.flush()
    requests.clear()
    blender.context.view_layer.update()
    assert not requests


def test_a_copy_asks_for_work_and_gets_its_own_group(blender, addon, build, live, requests):
    one = build()
    two = one.copy()
    blender.data.objects["plastic"].data.materials.append(two)
    two.update_tag()
    requests.clear()
    blender.context.view_layer.update()
    assert requests
    live._tick()
    groups = [addon("editing").group_of(item) for item in (one, two)]
    assert groups[0] != groups[1]


def test_tick_drafts_then_finishes_then_stops(blender, addon, build, live, source):
    material = build("metal", "NATIVE")
    drag(blender, addon("editing").group_of(material))
    material.nfm.edit.lobe_1.width = 3.0
    before = source(material)
    assert live._tick() == live.REST
    draft = source(material)
    assert draft != before
    assert live._tick() == 0.0
    assert source(material) != draft
    assert live._tick() is None


def test_what_cannot_be_made_is_told_once(blender, addon, build, live, capfd):
    material = build()
    material.nfm.parameters = "{"
    assert live.flush() == []
    assert "nfm: material 'plastic': not valid JSON" in capfd.readouterr().out
    assert live.flush() == []
    assert capfd.readouterr().out == ""


def test_materials_that_lost_their_nodes_are_left_alone(blender, build, live):
    material = build()
    material.node_tree.nodes.clear()
    assert live.flush() == []
    assert live._tick() is None


def test_apply_edits(blender, build, source):
    material = build()
    before = source(material)
    material.nfm.edit.lobe_1.width = 2.0
    assert source(material) == before
    assert blender.ops.nfm.apply_edits() == {"FINISHED"}
    assert source(material) != before


def test_a_render_shows_the_last_edit(blender, addon, build, live, sphere_scene, render):
    material = addon("material").build(FittedMaterial("metal", MODELS["metal"]), "REFERENCE")
    scene = sphere_scene(material, resolution=8)
    before = render(scene).mean()
    for lobe in ("lobe_1", "lobe_2", "lobe_3"):
        getattr(material.nfm.edit, lobe).falloff = 0.0
    material.nfm.edit.edge_strength = 0.0
    assert render(scene).mean() < 0.95 * before


def test_undo_brings_the_shader_back(blender, addon, build, live, source):
    material = build()
    before = source(material)
    blender.ops.ed.undo_push(message="before")
    material.nfm.edit.lobe_1.width = 2.0
    blender.ops.ed.undo_push(message="slider")
    live.flush()
    assert source(material) != before
    blender.ops.ed.undo()
    live._tick()
    material = blender.data.materials["plastic"]
    assert material.nfm.edit.lobe_1.width == 1
    assert source(material) == before
    blender.ops.ed.redo()
    live.flush()
    material = blender.data.materials["plastic"]
    assert material.nfm.edit.lobe_1.width == 2
    assert source(material) != before


def test_a_saved_file_holds_the_last_edit(blender, build, source, tmp_path):
    """It may be rendered where there is no add-on."""
    material = build()
    before = source(material)
    material.nfm.edit.lobe_1.width = 2.0
    assert source(material) == before
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert source(material) != before


def test_a_save_leaves_copies_together_that_nothing_tells_apart(blender, build, source, tmp_path):
    """Three looks of one material in other nodes would else be three tables in the file."""
    material = build()
    alike, other = material.copy(), material.copy()
    other.nfm.edit.lobe_1.width = 2.0
    groups = len(blender.data.node_groups)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert len(blender.data.node_groups) == groups + 1
    assert source(alike) == source(material) != source(other)


def test_a_save_finishes_a_draft(blender, addon, tmp_path):
    fitted = FittedMaterial("paint", MODELS["paint"])
    addon("known_shadings").forget()
    material = addon("material").build(fitted, "NATIVE", draft=True)
    assert material.nfm.native_psnr == 0
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert material.nfm.native_psnr > 30
    assert not addon("editing").refresh(material)


def test_in_the_background_nothing_is_shown_as_a_draft(addon, build, live, source, requests):
    material = build("metal", "NATIVE")
    material.nfm.edit.lobe_1.width = 2.0
    live.show(material)
    assert requests
    assert not addon("editing").refresh(material)
