# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import pytest

from tests.models import MODELS


@pytest.fixture
def known(addon):
    module = addon("known_shadings")
    module.forget()
    yield module
    module.forget()


def test_a_model_with_the_same_numbers_is_known(known):
    model = MODELS["paint"]
    assert known.find(model) is None
    assert known.remember(model, "shading") == "shading"
    assert known.find(replace(model, ndf=model.ndf.copy())) == "shading"
    assert known.find(replace(model, ndf=model.ndf * 1.001)) is None


def test_what_was_not_used_for_long_is_forgotten(known):
    models = [replace(MODELS["paint"], diffuse=MODELS["paint"].diffuse + i) for i in range(20)]
    known.remember(models[0], 0)
    for number in range(1, known.MOST):
        known.remember(models[number], number)
    assert known.find(models[0]) == 0  # used again
    known.remember(models[known.MOST], known.MOST)
    assert known.find(models[0]) == 0
    assert known.find(models[1]) is None


def test_a_model_that_is_asked_for_again_is_hashed_once(known, monkeypatch):
    hashed = []
    sha256 = known.sha256
    monkeypatch.setattr(known, "sha256", lambda kind: hashed.append(kind) or sha256(kind))
    model, other = MODELS["paint"], MODELS["metal"]
    for _ in range(3):
        assert known.find(model) is None
        assert known.is_same(model, model)
    assert len(hashed) == 1
    known.remember(other, "shading")
    assert known.find(model) is None
    assert known.find(other) == "shading"


def test_a_known_base_is_not_fitted_again(known, addon, monkeypatch):
    source = addon("shader_source")
    fitted = []
    shade = source.shade
    monkeypatch.setattr(source, "shade", lambda model: fitted.append(model) or shade(model))
    model = MODELS["paint"]
    first = source.new_surface(model, "native")
    again = source.new_surface(model, "exact")
    draft = source.new_surface(model, "native", draft=True)
    assert len(fitted) == 1
    assert first.error == again.error == draft.error
    assert draft.source == first.source
