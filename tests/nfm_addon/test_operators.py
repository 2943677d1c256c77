# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on a material that is there: refit, replace, reset, export, presets."""

import numpy as np
import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS


@pytest.fixture
def item(addon, fitted, mesh_object):
    """A material on the active object."""
    thing = mesh_object()
    material = addon("material").build(fitted)
    thing.data.materials.append(material)
    return material


@pytest.fixture
def metal_path(tmp_path):
    path = tmp_path / "metal.nfm.json"
    parameter_file.save(path, FittedMaterial("metal", MODELS["metal"]))
    return str(path)


@pytest.mark.parametrize(
    "name",
    ["refit", "replace_measurement", "reset_material", "export_parameters"],
)
def test_poll_wants_a_measured_material(name, blender, item, mesh_object):
    operator = getattr(blender.ops.nfm, name)
    assert operator.poll()
    mesh_object(slots=1)
    assert not operator.poll()


def test_replacing_keeps_the_material_and_what_was_set(blender, addon, item, metal_path):
    inputs = addon("node_group").find_group_node(item).inputs
    inputs["Lobe 1 Scale"].default_value = (0.5, 0.5, 0.5, 1)
    blender.ops.nfm.replace_measurement(filepath=metal_path)
    assert blender.context.object.active_material == item
    np.testing.assert_array_equal(
        addon("material").fitted_material(item).model.ndf, MODELS["metal"].ndf
    )
    assert inputs["Lobe 1 Scale"].default_value[0] == 0.5
    assert item.nfm.source_path == metal_path


def test_replacing_by_a_bad_file_changes_nothing(blender, item, tmp_path):
    before = item.nfm.parameters
    with pytest.raises(RuntimeError, match="no such file"):
        blender.ops.nfm.replace_measurement(filepath=str(tmp_path / "none.binary"))
    assert item.nfm.parameters == before


@pytest.mark.osl
def test_a_model_whose_shader_does_not_compile_is_not_taken(
    blender, addon, item, metal_path, monkeypatch
):
    before = item.nfm.parameters
    surface = addon("shader_source").Surface("shader broken(", None)
    monkeypatch.setattr(addon("editing.shader"), "new_surface", lambda *_, **__: surface)
    with pytest.raises(RuntimeError, match="could not compile"):
        blender.ops.nfm.replace_measurement(filepath=metal_path)
    assert item.nfm.parameters == before


def test_refit_fits_the_same_file_with_another_quality(blender, addon, item, fitted, monkeypatch):
    calls = []

    def fit(path, *, encoding, quality):
        calls.append((path, encoding, quality))
        return FittedMaterial("x", MODELS["metal"], fitted.source, {"quality": quality})

    monkeypatch.setattr(addon("operators.refit"), "material_from_file", fit)
    with pytest.raises(RuntimeError, match="is not known; use Replace"):
        blender.ops.nfm.refit()
    item.nfm.source_path = "/measured/blue.binary"
    blender.ops.nfm.refit(quality="BEST")
    assert calls == [("/measured/blue.binary", None, "best")]
    assert item.nfm.quality == "best"


def test_refit_takes_the_numbers_as_before_unless_told(blender, addon, item, fitted, monkeypatch):
    calls = []

    def fit(_path, *, encoding, quality):
        calls.append(encoding)
        return FittedMaterial("x", MODELS["metal"], fitted.source, {"encoding": encoding})

    monkeypatch.setattr(addon("operators.refit"), "material_from_file", fit)
    blender.ops.nfm.replace_measurement(filepath="/measured/x.bin", encoding="srgb-140")
    blender.ops.nfm.refit()
    blender.ops.nfm.refit(encoding="linear")
    blender.ops.nfm.refit()
    assert calls == ["srgb-140", "srgb-140", "linear", "linear"]


def test_reset(blender, addon, item, fitted):
    inputs = addon("node_group").find_group_node(item).inputs
    inputs["Diffuse"].default_value = (1, 0, 0, 1)
    inputs["Lobe 3 Scale"].default_value = (0, 0, 0, 1)
    item.nfm.mute[0] = item.nfm.solo[1] = True
    blender.ops.nfm.reset_material()
    np.testing.assert_allclose(
        inputs["Diffuse"].default_value[:3], np.pi * fitted.model.diffuse, rtol=1e-6
    )
    assert inputs["Lobe 3 Scale"].default_value[:] == (1, 1, 1, 1)
    assert not any((*item.nfm.mute, *item.nfm.solo))


def test_export_writes_what_import_reads(blender, addon, item, fitted, tmp_path):
    path = tmp_path / "out.nfm.json"
    blender.ops.nfm.export_parameters(filepath=str(path))
    np.testing.assert_array_equal(parameter_file.load(path).model.ndf, fitted.model.ndf)
    with pytest.raises(RuntimeError, match="cannot be written"):
        blender.ops.nfm.export_parameters(filepath=str(tmp_path / "no" / "out.nfm.json"))


def test_the_library_folder_is_made(addon, blender, tmp_path, monkeypatch):
    monkeypatch.setattr(addon("preferences").DEFAULTS, "library_path", str(tmp_path / "a" / "b"))
    folder = addon("preferences").library_folder(blender.context)
    assert folder == tmp_path / "a" / "b"
    assert folder.is_dir()
