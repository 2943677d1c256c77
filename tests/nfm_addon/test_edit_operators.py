# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that edit the active measured material."""

import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture
def editing(addon):
    return addon("editing")


@pytest.fixture
def build(addon, mesh_object):
    """A measured material on an active object of its own."""

    def make(name="plastic"):
        material = addon("material").build(FittedMaterial(name, MODELS[name]), "REFERENCE")
        mesh_object().data.materials.append(material)
        return material

    return make


@pytest.fixture
def handles_of(addon):
    """Handles of a material's curves, by name."""
    return lambda item: addon("curve_nodes").handles(addon("editing").group_of(item))


@pytest.fixture
def source(addon):
    return lambda material: addon("material").find_script_node(material).script.as_string()


def drag(editing, material, name):
    mapping = editing.group_of(material).nodes[name].mapping
    mapping.curves[0].points[1].location[1] -= 0.1
    mapping.update()


def activate(blender, material):
    item = next(o for o in blender.data.objects if material.name in o.data.materials)
    blender.context.view_layer.objects.active = item


OPERATORS = (
    "reset_edits",
    "keep_energy",
    "copy_curve",
    "paste_curve",
    "copy_lobe",
    "paste_lobe",
    "save_edits",
    "load_edits",
    "blend_with",
)


@pytest.mark.parametrize("name", OPERATORS)
def test_needs_a_measured_material(name, blender, mesh_object):
    mesh_object(slots=1)
    blender.context.window_manager.nfm_clipboard = "{}"
    operator = getattr(blender.ops.nfm, name)
    assert not operator.poll()
    with pytest.raises(RuntimeError, match="The active material is not a measured BRDF"):
        operator()
    kind = operator.get_rna_type()
    assert kind.description
    for prop in kind.properties:
        assert (
            prop.identifier in ("rna_type", "check_existing") or prop.description or prop.is_hidden
        )


def test_reset_all(blender, addon, build, editing, source):
    material = build()
    before = source(material)
    edit = material.nfm.edit
    edit.lobe_1.width, edit.lobe_2.gain, edit.edge_tint = 2.0, 0.5, (1, 0, 0)
    edit.show_original = edit.keep_energy = True
    drag(editing, material, "Lobe 1 D")
    blender.ops.nfm.reset_edits()
    assert source(material) == before
    properties = addon("edit_properties")
    assert properties.sliders_of(edit) == properties.Sliders()
    assert not (edit.show_original or edit.keep_energy)
    assert editing.document_of(material).curves == editing.document_of(material).drawn


def test_reset_one_curve(blender, build, editing, handles_of):
    material = build()
    for name in ("Lobe 1 D", "Lobe 2 G", "F"):
        drag(editing, material, name)
    material.nfm.edit.lobe_1.haze = 0.5
    drawn = editing.drawn_handles(material)
    blender.ops.nfm.reset_edits(what="Lobe 1 D")
    found = handles_of(material)
    assert found["Lobe 1 D"] == drawn["Lobe 1 D"]
    assert found["Lobe 2 G"] != drawn["Lobe 2 G"]
    blender.ops.nfm.reset_edits(what="F")
    assert handles_of(material)["F Red"] == drawn["F Red"]
    blender.ops.nfm.reset_edits(what="CURVES")
    assert handles_of(material) == drawn
    assert material.nfm.edit.lobe_1.haze == 0.5
    blender.ops.nfm.reset_edits(what="SLIDERS")
    assert material.nfm.edit.lobe_1.haze == 0


def test_keep_energy(blender, build, editing):
    material = build("metal")
    material.nfm.edit.lobe_1.gain = 10.0
    blender.ops.nfm.apply_edits()
    assert editing.largest_albedo(material) > 2
    blender.ops.nfm.keep_energy()
    assert editing.largest_albedo(material) < 1.01


def test_copy_and_paste_a_curve_between_materials(blender, build, editing, handles_of):
    one, two = build("metal"), build("matte")
    activate(blender, one)
    drag(editing, one, "Lobe 1 D")
    blender.ops.nfm.copy_curve(curve="Lobe 1 D")
    activate(blender, two)
    blender.ops.nfm.paste_curve(curve="Lobe 3 D")
    assert handles_of(two)["Lobe 3 D"] == handles_of(one)["Lobe 1 D"]
    # the factor follows: it is about that of the other material
    ratio = editing.edited_model(two).ndf[2] / editing.edited_model(one).ndf[0]
    # as far as the axis goes down
    assert 0.5 < ratio[:40].min() < ratio[:40].max() < 2
    with pytest.raises(RuntimeError, match="copied was D, expected G"):
        blender.ops.nfm.paste_curve(curve="Lobe 3 G")


def test_copy_and_paste_the_color_curves(blender, build, handles_of):
    one, two = build("metal"), build("matte")
    activate(blender, one)
    blender.ops.nfm.copy_curve(curve="F")
    activate(blender, two)
    blender.ops.nfm.paste_curve(curve="F")
    found = [handles_of(item) for item in (one, two)]
    for name in ("F", "F Red", "F Green", "F Blue"):
        assert found[0][name] == found[1][name]


def test_copy_and_paste_a_lobe(blender, build, editing, handles_of):
    one, two = build("metal"), build("matte")
    activate(blender, one)
    one.nfm.edit.lobe_2.haze = 0.25
    drag(editing, one, "Lobe 2 G")
    blender.ops.nfm.copy_lobe(lobe=2)
    activate(blender, two)
    blender.ops.nfm.paste_lobe(lobe=1)
    assert two.nfm.edit.lobe_1.haze == 0.25
    found = [handles_of(item) for item in (one, two)]
    assert found[1]["Lobe 1 G"] == found[0]["Lobe 2 G"]
    assert found[1]["Lobe 1 D"] == found[0]["Lobe 2 D"]
    with pytest.raises(RuntimeError, match="copied was lobe, expected F"):
        blender.ops.nfm.paste_curve(curve="F")


def test_presets(blender, build, editing, source, tmp_path):
    material = build("metal")
    original = source(material)
    drag(editing, material, "Lobe 1 D")
    material.nfm.edit.lobe_2.width = 2.0
    blender.ops.nfm.apply_edits()
    edited = source(material)
    path = tmp_path / "worn.nfm.json"
    blender.ops.nfm.save_edits(filepath=str(path))
    saved = parameter_file.load(path)
    assert (saved.model.ndf == MODELS["metal"].ndf).all()
    assert saved.edits.sliders.lobes[1].width == 2
    # as a file to import
    blender.ops.nfm.import_measurement(filepath=str(path), sampling="REFERENCE")
    imported = blender.context.active_object.active_material
    assert imported != material
    assert source(imported) == edited
    blender.ops.nfm.reset_edits()
    assert source(imported) == original
    # as edits for a material
    blender.ops.nfm.load_edits(filepath=str(path))
    assert source(imported) == edited


def test_edits_of_another_material(blender, build, editing, handles_of, tmp_path):
    one, two = build("metal"), build("matte")
    activate(blender, one)
    drag(editing, one, "Lobe 1 D")
    one.nfm.edit.edge_strength = 2.0
    path = tmp_path / "edits.nfm.json"
    blender.ops.nfm.save_edits(filepath=str(path))
    activate(blender, two)
    before = handles_of(two)
    blender.ops.nfm.load_edits(filepath=str(path))
    after = handles_of(two)
    assert two.nfm.edit.edge_strength == 2
    assert [name for name in after if after[name] != before[name]] == ["Lobe 1 D"]


def test_a_fit_is_no_preset(blender, build, parameter_path):
    build()
    with pytest.raises(RuntimeError, match=r"blue\.nfm\.json: a fit without edits"):
        blender.ops.nfm.load_edits(filepath=str(parameter_path))


def test_blend_with(blender, build, editing, source):
    one, two = build("metal"), build("plastic")
    alone = source(one)
    two.nfm.edit.lobe_1.width = 2.0
    blender.ops.nfm.apply_edits()
    other = source(two)
    activate(blender, one)
    blender.ops.nfm.blend_with(material="plastic")
    assert source(one) == alone
    one.nfm.edit.blend = 0.5
    blender.ops.nfm.apply_edits()
    assert source(one) not in (alone, other)
    one.nfm.edit.blend = 1.0
    blender.ops.nfm.apply_edits()
    # the other as it is edited; its diffuse colour is an input
    tables = [text.partition("float  ndf_table")[2] for text in (source(one), other)]
    assert tables[0] == tables[1]
    blender.ops.nfm.blend_with(material="")
    assert source(one) == alone
    with pytest.raises(RuntimeError, match="no measured material 'nothing'"):
        blender.ops.nfm.blend_with(material="nothing")


def test_presets_of_a_blend(blender, build, brushed, source, tmp_path):
    one, _two = build("metal"), build("plastic")
    activate(blender, one)
    blender.ops.nfm.blend_with(material="plastic")
    one.nfm.edit.blend = 0.5
    blender.ops.nfm.apply_edits()
    path = tmp_path / "between.nfm.json"
    blender.ops.nfm.save_edits(filepath=str(path))
    blender.ops.nfm.import_measurement(filepath=str(path), sampling="REFERENCE")
    imported = blender.context.active_object.active_material
    assert imported.nfm.edit.blend == 0.5
    assert imported.nfm.edit.blend_name == "plastic"
    assert source(imported) == source(one)
    activate(blender, brushed)
    before = source(brushed)
    with pytest.raises(RuntimeError, match="load it into a material of the same kind"):
        blender.ops.nfm.load_edits(filepath=str(path))
    assert source(brushed) == before
    assert not brushed.nfm.edit.blend_parameters


def test_undo_is_one_step(blender, build, editing, handles_of):
    material = build()
    drag(editing, material, "Lobe 1 D")
    edited = handles_of(material)
    blender.ops.ed.undo_push(message="drag")
    blender.ops.nfm.reset_edits()
    blender.ops.ed.undo_push(message="reset")
    blender.ops.ed.undo()
    material = blender.data.materials["plastic"]
    assert handles_of(material) == edited


# ---- anisotropic ----


@pytest.fixture
def brushed(addon, mesh_object):
    """An anisotropic material on the active object."""
    fitted = FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"])
    material = addon("material").build(fitted, "REFERENCE")
    mesh_object().data.materials.append(material)
    return material


def test_materials_of_both_kinds_are_not_blended(blender, build, brushed):
    build("metal")
    with pytest.raises(RuntimeError, match="choose one of the same kind"):
        blender.ops.nfm.blend_with(material="brushed")


def test_a_curve_goes_from_one_kind_to_the_other(blender, build, brushed, editing, handles_of):
    one = build("metal")
    drag(editing, one, "Lobe 1 D")
    blender.ops.nfm.copy_curve(curve="Lobe 1 D")
    activate(blender, brushed)
    blender.ops.nfm.paste_curve(curve="Lobe 2 D")
    assert handles_of(brushed)["Lobe 2 D"] == handles_of(one)["Lobe 1 D"]
    with pytest.raises(RuntimeError, match="copied was D, expected D around"):
        blender.ops.nfm.paste_curve(curve="Lobe 2 D around")
    activate(blender, one)
    with pytest.raises(RuntimeError, match="'metal' has no curve Lobe 1 D around"):
        blender.ops.nfm.copy_curve(curve="Lobe 1 D around")


def test_a_lobe_goes_from_one_kind_to_the_other(blender, build, brushed, handles_of):
    brushed.nfm.edit.lobe_1.width_across = 2.0
    blender.ops.nfm.copy_lobe(lobe=1)
    blender.ops.nfm.paste_lobe(lobe=3)
    assert handles_of(brushed)["Lobe 3 G around"] == handles_of(brushed)["Lobe 1 G around"]
    one = build("metal")
    blender.ops.nfm.paste_lobe(lobe=1)
    assert handles_of(one)["Lobe 1 D"] == handles_of(brushed)["Lobe 1 D"]
    activate(blender, one)
    blender.ops.nfm.copy_lobe(lobe=1)
    activate(blender, brushed)
    before = handles_of(brushed)
    blender.ops.nfm.paste_lobe(lobe=2)
    after = handles_of(brushed)
    assert after["Lobe 2 G"] == handles_of(one)["Lobe 1 G"]
    assert after["Lobe 2 D around"] == before["Lobe 2 D around"]


def test_presets_of_an_anisotropic_material(blender, brushed, editing, source, tmp_path):
    original = source(brushed)
    drag(editing, brushed, "Lobe 1 D around")
    brushed.nfm.edit.lobe_2.width_along = 0.5
    blender.ops.nfm.apply_edits()
    edited = source(brushed)
    path = tmp_path / "worn.nfm.json"
    blender.ops.nfm.save_edits(filepath=str(path))
    saved = parameter_file.load(path)
    assert (saved.model.ndf == ANISOTROPIC_MODELS["brushed"].ndf).all()
    blender.ops.nfm.import_measurement(filepath=str(path), sampling="REFERENCE")
    imported = blender.context.active_object.active_material
    assert source(imported) == edited != original
    blender.ops.nfm.reset_edits()
    assert source(imported) == original
    blender.ops.nfm.load_edits(filepath=str(path))
    assert source(imported) == edited


def test_copying_changes_nothing(blender, build, editing, source):
    """Not even a shader that is waiting to be made."""
    material = build()
    before = source(material)
    material.nfm.edit.lobe_1.width = 2.0
    blender.ops.nfm.copy_curve(curve="F")
    blender.ops.nfm.copy_lobe(lobe=1)
    assert source(material) == before
    assert editing.refresh(material)
