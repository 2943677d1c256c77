# SPDX-License-Identifier: GPL-3.0-or-later
"""From curves and sliders to the shader; without a window, and without waiting for one."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from fitter.editing.blend import blend
from fitter.editing.curves import CURVES_OF
from fitter.editing.edits import Edits, LobeSliders, Sliders, apply
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS

BRUSHED = ANISOTROPIC_MODELS["brushed"]


@pytest.fixture
def editing(addon):
    return addon("editing")


@pytest.fixture
def nodes(addon):
    return addon("curve_nodes")


@pytest.fixture
def build(addon):
    def make(name="plastic", sampling="REFERENCE"):
        return addon("material").build(FittedMaterial(name, MODELS[name]), sampling)

    return make


@pytest.fixture
def source(addon):
    return lambda material: addon("material").find_script_node(material).script.as_string()


@pytest.fixture
def expected(addon):
    """Source of the shader of a model."""
    return lambda model, sampling="reference": (
        addon("shader_source").new_surface(model, sampling).source
    )


def drag(material, editing, name="Lobe 2 D", index=4, by=-0.1):
    """Move a handle, as a script does."""
    mapping = editing.group_of(material).nodes[name].mapping
    point = mapping.curves[0].points[index]
    point.location = (point.location[0], point.location[1] + by)
    mapping.update()


# ---- nothing edited ----


@pytest.mark.parametrize("sampling", ["NATIVE", "EXACT", "REFERENCE"])
def test_untouched_material_keeps_its_shader(sampling, build, editing, source, expected):
    material = build("metal", sampling)
    before = source(material)
    assert before == expected(MODELS["metal"], sampling.lower())
    assert not editing.refresh(material)
    # there and back again
    drag(material, editing, by=-0.125)
    assert editing.refresh(material)
    assert source(material) != before
    editing.reset_curves(material)
    assert editing.refresh(material)
    assert source(material) == before


def test_an_edit_of_another_version_of_blender_is_none(build, editing, source):
    """Heights may differ in the last digit; handles say that nothing was edited."""
    material = build()
    before = source(material)
    drawn = json.loads(material.nfm.edit.drawn)
    drawn["heights"]["Lobe 1 D"] = [value + 1e-7 for value in drawn["heights"]["Lobe 1 D"]]
    material.nfm.edit.drawn = json.dumps(drawn)
    editing.refresh(material)
    assert source(material) == before


# ---- curves ----


def test_a_curve_bends_its_factor_alone(build, editing, source, expected, addon):
    material = build()
    drag(material, editing, "Lobe 2 D", by=-0.1)
    editing.refresh(material)
    model = editing.edited_model(material)
    changed = model.ndf[1] != MODELS["plastic"].ndf[1]
    assert 0 < changed.sum() < 90
    np.testing.assert_array_equal(model.ndf[[0, 2]], MODELS["plastic"].ndf[[0, 2]])
    np.testing.assert_array_equal(model.fresnel, MODELS["plastic"].fresnel)
    assert source(material) == expected(model)


@pytest.mark.parametrize("name", ["Lobe 1 G", "F"])
def test_flat_zero_is_black(name, build, editing, nodes):
    material = build("metal")
    flat = ((0.0, 0.0, "VECTOR"), (1.0, 0.0, "VECTOR"))
    nodes.write(editing.group_of(material), {name: flat})
    editing.refresh(material)
    model = editing.edited_model(material)
    assert not (model.masking[0] if name == "Lobe 1 G" else model.fresnel).any()


@pytest.mark.parametrize("sampling", ["NATIVE", "EXACT"])
@pytest.mark.parametrize("seed", range(3))
def test_any_curve_compiles(seed, sampling, build, editing, nodes):
    """Spikes, walls, handles on top of each other and out of range."""
    rng = np.random.default_rng(seed)
    material = build("paint", sampling)
    group = editing.group_of(material)
    wild = {}
    for name in CURVES_OF["isotropic"]:
        count = int(rng.integers(2, 30))
        spots = rng.choice([0.0, 0.5, 0.5000001, 1.0, -3.0, 7.0], (count, 2))
        spots += rng.choice([0, 1], (count, 1)) * rng.random((count, 2))
        wild[name] = [(x, y, rng.choice(["AUTO", "VECTOR"])) for x, y in spots.tolist()]
    for name in wild:
        nodes.node_of(group, name).mapping.use_clip = False
    nodes.write(group, wild)
    assert editing.refresh(material)
    assert np.isfinite(material.nfm.native_error)


def test_removed_curve_counts_as_drawn(build, editing, source):
    material = build()
    before = source(material)
    drag(material, editing, "Lobe 2 D")
    editing.refresh(material)
    group = editing.group_of(material)
    group.nodes.remove(group.nodes["Lobe 2 D"])
    editing.refresh(material)
    assert source(material) == before
    editing.reset_curves(material, ("Lobe 2 D",))
    assert "Lobe 2 D" in group.nodes
    editing.refresh(material)
    assert source(material) == before


# ---- sliders ----


def test_sliders_make_the_model_that_the_fitter_makes(build, editing, source, expected):
    material = build("metal")
    edit = material.nfm.edit
    edit.lobe_2.width, edit.lobe_3.haze, edit.edge_strength = 2.0, 0.25, 1.5
    edit.specular_saturation = 0.5
    editing.refresh(material)
    lobes = (LobeSliders(), LobeSliders(width=2.0), LobeSliders(haze=0.25))
    sliders = Sliders(lobes=lobes, edge_strength=1.5, specular_saturation=0.5)
    assert source(material) == expected(apply(MODELS["metal"], Edits(sliders=sliders)))


def test_scales_gains_and_diffuse_colors_write_no_shader(build, editing, addon, monkeypatch):
    material = build("paint")
    monkeypatch.setattr(addon("editing.shader"), "new_surface", None)
    group = editing.group_of(material)
    node = addon("material").find_group_node(material)
    node.inputs["Lobe 1 Scale"].default_value = (2, 1, 1, 1)
    assert not editing.refresh(material)
    material.nfm.edit.lobe_2.gain = 0.25
    material.nfm.edit.diffuse_saturation = 0.0
    assert editing.refresh(material)
    assert tuple(group.nodes["Lobe 2 Gain"].inputs[1].default_value) == (0.25,) * 3
    assert tuple(group.nodes["Diffuse Red"].inputs[1].default_value) == pytest.approx(
        (0.2126, 0.7152, 0.0722)
    )
    assert not editing.refresh(material)


def test_original_is_shown_and_edits_come_back(build, editing, source):
    material = build()
    original = source(material)
    edit = material.nfm.edit
    edit.lobe_1.width, edit.lobe_2.gain = 3.0, 0.5
    drag(material, editing)
    editing.refresh(material)
    edited = source(material)
    edit.show_original = True
    editing.refresh(material)
    assert source(material) == original
    gain = editing.group_of(material).nodes["Lobe 2 Gain"].inputs[1].default_value
    assert tuple(gain) == (1, 1, 1)
    edit.show_original = False
    editing.refresh(material)
    assert source(material) == edited
    assert gain[0] == 0.5


# ---- drafts ----


def test_draft_keeps_closures_and_is_finished_later(build, editing, source, expected):
    material = build("metal", "NATIVE")
    material.nfm.edit.lobe_1.width = 4.0
    error = material.nfm.native_error
    assert editing.refresh(material, draft=True)
    draft = source(material)
    assert material.nfm.native_error == error
    assert editing.is_drafted(material)
    assert not editing.refresh(material, draft=True)
    assert editing.refresh(material)
    finished = source(material)
    assert finished == expected(editing.edited_model(material), "native") != draft
    assert material.nfm.native_error != error
    assert not editing.refresh(material)


# ---- energy ----


def test_energy_is_told_and_kept(build, editing):
    material = build("metal")
    assert editing.largest_albedo(material) < 1.01
    edit = material.nfm.edit
    edit.lobe_1.gain, edit.edge_strength = 5.0, 3.0
    editing.refresh(material)
    assert editing.largest_albedo(material) > 1.5
    edit.keep_energy = True
    editing.refresh(material)
    assert editing.largest_albedo(material) < 1.01
    # further edits stay within it
    edit.lobe_2.gain = 20.0
    assert editing.refresh(material)
    assert editing.largest_albedo(material) < 1.01


def test_energy_counts_what_is_typed_into_sockets(build, editing, addon):
    material = build("matte")
    inputs = addon("material").find_group_node(material).inputs
    before = editing.largest_albedo(material)
    inputs["Diffuse"].default_value = (2, 2, 2, 1)
    assert editing.largest_albedo(material) > 2
    inputs["Diffuse"].default_value = (0, 0, 0, 1)
    assert editing.largest_albedo(material) < before


# ---- blend ----


@pytest.fixture
def blended(build):
    material = build("plastic")
    edit = material.nfm.edit
    other = FittedMaterial("metal", MODELS["metal"])
    edit.blend_name, edit.blend_parameters = "metal", parameter_file.dumps(other)
    return material


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_blend(share, blended, editing, source, expected):
    blended.nfm.edit.blend = share
    editing.refresh(blended)
    model = blend(MODELS["plastic"], MODELS["metal"], blended.nfm.edit.blend)
    found = editing.edited_model(blended)
    for name in ("diffuse", "scale", "ndf", "masking", "fresnel"):
        np.testing.assert_allclose(getattr(found, name), getattr(model, name), atol=1e-12)
    if share in (0.0, 1.0):
        assert source(blended) == expected(replace(model, diffuse=model.diffuse))
    # the diffuse colour comes through the socket
    group = editing.group_of(blended)
    rows = [group.nodes[f"Diffuse {c}"].inputs[1].default_value for c in ("Red", "Green", "Blue")]
    socket = np.pi * MODELS["plastic"].diffuse
    offset = np.array(group.nodes["Diffuse Offset"].inputs[1].default_value)
    shown = np.array([tuple(row) for row in rows]) @ socket + offset
    np.testing.assert_allclose(shown, np.pi * model.diffuse, atol=1e-6)


# ---- copies ----


@pytest.mark.osl
def test_copies_diverge_when_one_is_edited(blender, build, editing, source, addon):
    one = build()
    two = one.copy()
    assert editing.group_of(two) == editing.group_of(one)
    before = source(one)
    two.nfm.edit.lobe_1.width = 2.0
    editing.refresh(two)
    assert editing.group_of(two) != editing.group_of(one)
    assert source(one) == before
    assert source(two) != before
    scripts = [addon("material").find_script_node(item) for item in (one, two)]
    assert scripts[0].script != scripts[1].script
    assert scripts[0].bytecode != scripts[1].bytecode
    assert not editing.refresh(one)
    # the original may be edited too
    drag(one, editing)
    editing.refresh(one)
    assert source(one) != before


def test_a_copy_takes_another_model(build, editing, addon):
    one = build()
    two = one.copy()
    before = editing.state.state_of(one).digest()
    addon("material").replace_model(two, FittedMaterial("metal", MODELS["metal"]))
    assert editing.state.state_of(one).digest() == before
    assert not editing.refresh(one)


def test_sampling_of_a_copy_is_its_own(build, source):
    one = build(sampling="REFERENCE")
    two = one.copy()
    before = source(one)
    two.nfm.sampling = "COSINE"
    assert source(one) == before
    assert source(two) != before


def test_a_copied_group_gets_a_text_of_its_own(build, addon, editing, source):
    one = build()
    two = one.copy()
    node = addon("material").find_group_node(two)
    node.node_tree = node.node_tree.copy()  # as "Make single user" does
    before = source(one)
    two.nfm.edit.lobe_1.width = 2.0
    editing.refresh(two)
    assert source(one) == before != source(two)


def test_renamed_things_are_found(build, editing, addon):
    material = build()
    script = addon("material").find_script_node(material)
    material.name, script.script.name, script.id_data.name = "other", "text", "group"
    material.nfm.edit.lobe_1.width = 2.0
    assert editing.refresh(material)
    assert not editing.refresh(material)


def test_appended_material_can_be_edited(blender, build, editing, source, tmp_path):
    before = source(build())
    path = tmp_path / "library.blend"
    blender.data.materials["plastic"].use_fake_user = True
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with blender.data.libraries.load(str(path), link=False) as (_, wanted):
        wanted.materials = ["plastic"]
    material = blender.data.materials["plastic"]
    assert not editing.refresh(material)
    assert source(material) == before
    material.nfm.edit.lobe_1.width = 2.0
    assert editing.refresh(material)
    assert source(material) != before


def test_edits_are_saved_with_the_file(blender, build, editing, source, tmp_path):
    material = build()
    material.use_fake_user = True
    drag(material, editing)
    material.nfm.edit.lobe_1.width = 2.0
    editing.refresh(material)
    edited = source(material)
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    material = blender.data.materials["plastic"]
    assert not editing.refresh(material)
    assert source(material) == edited


# ---- anisotropic ----


@pytest.fixture
def brushed(addon):
    fitted = FittedMaterial("brushed", BRUSHED)
    return addon("material").build(fitted, "REFERENCE")


def test_untouched_anisotropic_material_keeps_its_shader(brushed, editing, nodes, source, expected):
    before = source(brushed)
    assert before == expected(BRUSHED)
    assert tuple(nodes.handles(editing.group_of(brushed))) == CURVES_OF["anisotropic"]
    assert not editing.refresh(brushed)
    drag(brushed, editing, "Lobe 1 D around", 2)
    assert editing.refresh(brushed)
    assert source(brushed) != before
    editing.reset_curves(brushed)
    assert editing.refresh(brushed)
    assert source(brushed) == before


@pytest.mark.parametrize("name", ["Lobe 1 D", "Lobe 1 D around", "Lobe 1 G", "Lobe 1 G around"])
def test_a_curve_bends_its_anisotropic_factor_alone(name, brushed, editing, source, expected):
    drag(brushed, editing, name, index=1)
    editing.refresh(brushed)
    measured, model = BRUSHED, editing.edited_model(brushed)
    changed, kept = ("ndf", "masking") if " D" in name else ("masking", "ndf")
    assert (getattr(model, changed)[0] != getattr(measured, changed)[0]).any()
    np.testing.assert_array_equal(getattr(model, changed)[1:], getattr(measured, changed)[1:])
    np.testing.assert_array_equal(getattr(model, kept), getattr(measured, kept))
    assert source(brushed) == expected(model)


@pytest.mark.parametrize("end", [0, -1])
def test_curves_around_end_where_they_begin(end, brushed, editing, nodes):
    group = editing.group_of(brushed)
    points = group.nodes["Lobe 2 D around"].mapping.curves[0].points
    for height in (0.25, 0.75):
        points[end].location.y = height
        editing.refresh(brushed)
        handles = nodes.handles(group)["Lobe 2 D around"]
        assert handles[0][1] == handles[-1][1] == height
    assert not editing.refresh(brushed)
    editing.reset_curves(brushed)
    editing.refresh(brushed)
    assert nodes.handles(group) == editing.drawn_handles(brushed)


def test_energy_of_an_anisotropic_material_is_kept(brushed, editing):
    edit = brushed.nfm.edit
    edit.lobe_1.gain = 10.0
    editing.refresh(brushed)
    assert editing.largest_albedo(brushed) > 2
    edit.keep_energy = True
    editing.refresh(brushed)
    assert 0.9 < editing.largest_albedo(brushed) < 1.01


def test_blend_of_anisotropic_materials(brushed, editing, source, expected):
    other = ANISOTROPIC_MODELS["satin"]
    edit = brushed.nfm.edit
    edit.blend_name = "satin"
    edit.blend_parameters = parameter_file.dumps(FittedMaterial("satin", other))
    for share in (0.5, 1.0):
        edit.blend = share
        editing.refresh(brushed)
        mixed = blend(BRUSHED, other, share)
        found = editing.edited_model(brushed)
        np.testing.assert_allclose(found.ndf, mixed.ndf, rtol=1e-12)
        np.testing.assert_allclose(found.diffuse, mixed.diffuse, atol=1e-12)
    assert source(brushed) == expected(other)


def test_material_from_before_there_were_curves(brushed, editing, nodes, source):
    """Reset draws them."""
    before = source(brushed)
    group = editing.group_of(brushed)
    for name in CURVES_OF["anisotropic"]:
        if name in group.nodes:
            group.nodes.remove(group.nodes[name])
    brushed.nfm.edit.drawn = ""
    editing.refresh(brushed)
    assert source(brushed) == before
    editing.reset_curves(brushed, ("Lobe 1 D around",))
    assert tuple(nodes.handles(group)) == CURVES_OF["anisotropic"]
    editing.refresh(brushed)
    assert source(brushed) == before


def test_anisotropic_draft_has_fewer_views_and_is_finished(brushed, editing, source, expected):
    """Base lobes follow what changes the model: a slider over F, say."""
    brushed.nfm.sampling = "NATIVE"
    closures = closures_of(source(brushed))
    brushed.nfm.edit.edge_strength = 2.5
    assert editing.refresh(brushed, draft=True)
    draft = source(brushed)
    assert closures_of(draft) == closures
    assert rows_of(draft) < rows_of(expected(BRUSHED, "native"))
    brushed.nfm.native_error = 0.0
    assert editing.refresh(brushed)
    assert source(brushed) == expected(editing.edited_model(brushed), "native") != draft
    assert 0 < brushed.nfm.native_error < 0.02


def closures_of(source):
    return re.findall(r"closure_\w+\[\d+\] = \{[^}]*\}", source)


def rows_of(source):
    return int(re.search(r"#define N_VIEW_ROWS (\d+)", source)[1])


def test_a_new_material_may_begin_as_a_draft(addon, editing, source, expected, monkeypatch):
    addon("known_shadings").forget()
    shader_source = addon("shader_source")
    shade, shaded = shader_source.shade, []
    monkeypatch.setattr(shader_source, "shade", lambda model: shaded.append(model) or shade(model))
    fitted = FittedMaterial("brushed", BRUSHED)
    drafted = addon("material").build(fitted, "NATIVE", draft=True)
    assert not shaded
    assert editing.is_drafted(drafted)
    assert drafted.nfm.native_psnr == 0
    assert editing.slow_model(drafted) is editing.slow_model(drafted) is not None
    draft = source(drafted)
    assert not editing.refresh(drafted, draft=True)
    assert editing.refresh(drafted)
    assert len(shaded) == 1
    assert source(drafted) == expected(BRUSHED, "native") != draft
    assert drafted.nfm.native_psnr > 30
    assert not editing.refresh(drafted)
    # whose base lobes are known needs no draft
    again = addon("material").build(fitted, "NATIVE", draft=True)
    assert source(again) == source(drafted)
    assert not editing.refresh(again)


def test_a_draft_of_a_sampling_without_base_lobes_is_finished(build, editing, source):
    material = build("plastic", "REFERENCE")
    material.nfm.edit.lobe_1.width = 2.0
    assert editing.refresh(material, draft=True)
    assert not editing.refresh(material)


def test_base_lobes_of_a_preset_are_found_once(addon, editing, build, source, monkeypatch):
    edited = build("metal", "NATIVE")
    edited.nfm.edit.lobe_1.width = 2.0
    editing.refresh(edited)
    preset = FittedMaterial("metal", MODELS["metal"], edits=editing.document_of(edited))
    addon("known_shadings").forget()
    shader_source = addon("shader_source")
    shade, shaded = shader_source.shade, []
    monkeypatch.setattr(shader_source, "shade", lambda model: shaded.append(model) or shade(model))
    again = addon("material").build(preset, "NATIVE")
    assert len(shaded) == 1
    assert source(again) == source(edited)
    assert again.nfm.native_psnr == edited.nfm.native_psnr
