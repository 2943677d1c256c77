# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit does to materials, and what undo makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from fitter.shading.shading import shade
from tests.models import ANISOTROPIC_MODELS, MODELS


def draft_is_there(started):
    return lambda: started.item.material_slots and started.item.active_material is not None


@pytest.fixture
def result(addon, fitted):
    """A finished fit of given quality."""

    def make(quality, model="plastic"):
        made = type(fitted)("blue plastic", MODELS[model], fitted.source, {"quality": quality})
        return addon("fitting.queue").FitResult(made)

    return make


@pytest.fixture
def landed(addon, mesh_object, result):
    """A NewMaterial whose draft is on an object."""
    place = addon("fitting.landing").NewMaterial("/x.binary", "NATIVE", [mesh_object().session_uid])
    place.draft(result("draft"))
    return place


@pytest.fixture
def material_of(blender):
    return lambda: blender.data.objects["Thing"].active_material


def test_the_fit_replaces_the_draft_and_keeps_what_the_artist_did(
    landed, result, material_of, addon
):
    draft = material_of()
    group = addon("material").find_group_node(draft)
    group.inputs["Lobe 2 Scale"].default_value = (0.5, 0.25, 1, 1)
    draft.name = "renamed"
    landed.final(result("standard", "metal"))
    assert material_of() == draft
    assert draft.name == "renamed"
    assert group.inputs["Lobe 2 Scale"].default_value[:] == (0.5, 0.25, 1, 1)
    found = addon("material").fitted_material(draft).model
    np.testing.assert_array_equal(found.scale, MODELS["metal"].scale)


@pytest.mark.parametrize("touched", [False, True])
def test_diffuse_follows_the_fit_unless_it_was_touched(touched, landed, result, material_of, addon):
    socket = addon("material").find_group_node(material_of()).inputs["Diffuse"]
    if touched:
        socket.default_value = (1, 0, 0, 1)
    landed.final(result("standard", "matte"))
    expected = (1, 0, 0) if touched else np.pi * MODELS["matte"].diffuse
    np.testing.assert_allclose(socket.default_value[:3], expected, rtol=1e-6)


def test_a_draft_that_was_removed_stays_removed(landed, result, blender, addon):
    addon("material").remove(blender.data.materials["blue plastic"])
    message = landed.final(result("standard"))
    assert message == "blue plastic: its draft was removed, and so is the fit"
    assert not blender.data.materials
    landed.abandon()


def test_copies_of_a_draft_get_the_fit_too(landed, result, material_of):
    copy = material_of().copy()
    landed.final(result("standard"))
    assert (copy.nfm.quality, material_of().nfm.quality) == ("standard", "standard")


def test_import_is_one_undo_step_although_a_draft_came_first(
    blender, addon, mesh_object, result, undo_steps, material_of
):
    uid = mesh_object().session_uid
    blender.ops.ed.undo_push(message="before")
    place = addon("fitting.landing").NewMaterial("/x.binary", "NATIVE", [uid])
    place.draft(result("draft"))
    place.final(result("standard"))
    assert undo_steps == ["Import Measured BRDF"]
    blender.ops.ed.undo()
    assert material_of() is None
    assert not blender.data.materials
    blender.ops.ed.redo()
    # the step holds the draft; what is seen is the fit
    assert material_of().nfm.quality == "standard"


def test_undoing_the_draft_drops_the_fit(blender, addon, mesh_object, result, undo_steps):
    uid = mesh_object().session_uid
    blender.ops.ed.undo_push(message="before")
    place = addon("fitting.landing").NewMaterial("/x.binary", "NATIVE", [uid])
    place.draft(result("draft"))
    blender.ops.ed.undo()
    place.final(result("standard"))
    assert not blender.data.materials
    blender.ops.ed.redo()
    assert blender.data.materials["blue plastic"].nfm.quality == "standard"


def test_a_model_is_replaced_in_one_step(blender, addon, fitted, result, undo_steps):
    item = addon("material").build(fitted)
    place = addon("fitting.landing").ExistingMaterial(item.session_uid, "/y.binary", "Refit")
    assert place.wants_draft is False
    place.final(result("best", "metal"))
    assert undo_steps == ["Refit"]
    assert item.nfm.quality == "best"
    assert item.nfm.source_path == "/y.binary"


def test_a_material_that_is_gone_is_told(addon, fitted, result):
    item = addon("material").build(fitted)
    place = addon("fitting.landing").ExistingMaterial(item.session_uid, "/y.binary", "Refit")
    addon("material").remove(item)
    assert "was removed meanwhile" in place.final(result("best"))
    place.abandon()


def test_undo_does_not_bring_a_cancelled_draft_back(
    blender, addon, mesh_object, result, undo_steps, material_of
):
    item = mesh_object(slots=1)
    blender.ops.ed.undo_push(message="before")
    place = addon("fitting.landing").NewMaterial("/x.binary", "NATIVE", [item.session_uid])
    place.draft(result("draft"))
    place.abandon()
    assert undo_steps == ["Import Measured BRDF", "Cancel Import"]
    for _ in range(2):
        blender.ops.ed.undo()
        assert material_of().name == "old 0"
        assert list(blender.data.materials.keys()) == ["old 0"]


@pytest.mark.parametrize("waits", [True, False])
def test_base_lobes_that_take_seconds_come_later_unless_one_waits(waits, addon, monkeypatch):
    addon("known_shadings").forget()
    source, landing, fitting = (
        addon(n) for n in ("shader_source", "fitting.landing", "fitting.queue")
    )
    shaded = []
    monkeypatch.setattr(
        source, "shade", lambda model: shaded.append(model) or shade(model, draft=True)
    )
    brushed = ANISOTROPIC_MODELS["brushed"]
    result = fitting.FitResult(FittedMaterial("brushed", brushed))
    message = landing.NewMaterial("/x.nfm.json", "NATIVE", [], waits=waits).final(result)
    assert ("error of native sampling" in message) == waits
    (item,) = addon("editing").measured_materials()
    assert addon("editing").refresh(item) != waits
    other = fitting.FitResult(FittedMaterial("other", replace(brushed, scale=brushed.scale / 2)))
    shaded.clear()
    landing.ExistingMaterial(item.session_uid, "/y", "Replace", waits).final(other)
    assert bool(shaded) == waits


def test_base_lobes_that_take_no_time_are_never_drafts(addon, result):
    addon("known_shadings").forget()
    message = addon("fitting.landing").NewMaterial("/x", "NATIVE", []).final(result("best"))
    assert "error of native sampling" in message
    (item,) = addon("editing").measured_materials()
    assert not addon("editing").refresh(item)
