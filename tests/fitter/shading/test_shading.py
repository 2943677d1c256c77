# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import fit_base_lobes
from fitter.shading.shading import load, save, shade
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture(scope="module")
def shading():
    return shade(MODELS["paint"])


def test_base_and_its_error_are_those_of_the_model(shading):
    base = fit_base_lobes(MODELS["paint"])
    assert shading.base.closures == base.closures
    np.testing.assert_array_equal(shading.base.weights, base.weights)
    assert shading.error == base_error(MODELS["paint"], base)


def test_a_file_gives_back_every_bit(shading, tmp_path):
    save(tmp_path / "base.npz", shading)
    again = load(tmp_path / "base.npz")
    assert again.base.closures == shading.base.closures
    assert again.error == shading.error
    for name in ("theta_o", "weights", "picking"):
        np.testing.assert_array_equal(getattr(again.base, name), getattr(shading.base, name))


def test_a_draft_has_fewer_views_of_an_anisotropic_model():
    model = ANISOTROPIC_MODELS["satin"]
    draft = shade(model, draft=True)
    assert draft.base.weights.shape[:2] == (7, 8)
    assert 0 < draft.error.image < 0.05
