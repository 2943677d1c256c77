# SPDX-License-Identifier: GPL-3.0-or-later
"""Base lobes of anisotropic materials, found by a process; the interface only asks."""

import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.bases import shading_of
from tests.models import ANISOTROPIC_MODELS, MODELS

MODEL = ANISOTROPIC_MODELS["brushed"]


@pytest.fixture
def background(addon):
    module = addon("background_shading")
    known = addon("known_shadings")
    known.forget()
    yield module
    module.stop()
    known.forget()
    assert folders() == []


def folders():
    return [path for path in Path(bpy.app.tempdir).iterdir() if path.name.startswith("nfm-")]


def wait(background, model, seconds=120):
    for _ in range(int(seconds / 0.05)):
        if background.is_over(model):
            return
        time.sleep(0.05)
    raise AssertionError("the base lobes were not found")


def test_the_base_is_found_beside_the_interface(background, addon):
    known = addon("known_shadings")
    assert not background.is_over(MODEL)
    assert known.find(MODEL) is None
    wait(background, MODEL)
    found, expected = known.find(MODEL), shading_of("brushed")
    assert vars(found.error) == vars(expected.error)
    np.testing.assert_array_equal(found.base.weights, expected.base.weights)


def test_asking_does_not_wait(background):
    background.is_over(MODEL)  # starts the process
    before = time.monotonic()
    for _ in range(20):
        background.is_over(MODEL)
    assert time.monotonic() - before < 0.5


def test_another_model_takes_the_place_of_the_first(background):
    background.is_over(MODEL)
    (first,) = {path.name for path in folders()} - {background._search._process.folder.name}
    background.is_over(replace(MODEL, diffuse=MODEL.diffuse + 0.01))
    assert first not in {path.name for path in folders()}
    assert len(folders()) == 2  # the model, and what the process writes


def test_a_process_that_dies_leaves_the_work_to_whoever_asks(background, addon):
    background.is_over(MODEL)
    background._search._process._process.kill()
    wait(background, MODEL)
    assert addon("known_shadings").find(MODEL) is None


def test_a_closed_file_ends_the_search(background, blender):
    background.is_over(MODEL)
    process = background._search._process._process
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert process.poll() is not None


def test_an_edited_material_is_finished_by_it(background, addon, blender, monkeypatch):
    live, editing = addon("live"), addon("editing")
    material = addon("material").build(FittedMaterial("brushed", MODEL), "NATIVE")
    addon("known_shadings").forget()
    asked = []
    monkeypatch.setattr(background, "is_over", lambda model: asked.append(model) or len(asked) > 2)
    shade_here = []
    source = addon("shader_source")
    monkeypatch.setattr(
        source, "shade", lambda model: shade_here.append(model) or shading_of("brushed")
    )
    material.nfm.edit.lobe_1.haze = 0.3
    assert live._tick() == live.REST  # the draft
    assert editing.is_drafted(material)
    assert live._tick() == live.PATIENCE
    assert live._tick() == live.PATIENCE
    assert shade_here == []
    assert live._tick() == 0.0
    assert len(shade_here) == 1  # this search found nothing
    assert live._tick() is None
    assert len(asked) == 3


def test_nobody_waits_for_isotropic_materials(background, addon, blender):
    material = addon("material").build(FittedMaterial("paint", MODELS["paint"]), "NATIVE")
    material.nfm.edit.lobe_1.haze = 0.3
    assert addon("editing").slow_model(material) is None
