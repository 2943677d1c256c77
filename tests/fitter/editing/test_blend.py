# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import fields, replace

import numpy as np
import pytest

from fitter.editing.blend import blend, mix
from fitter.models.model import FactorModel
from fitter.models.tables import directional_albedo
from tests.models import MODELS

FACTORS = [field.name for field in fields(FactorModel)]
PAIRS = [("plastic", "metal"), ("velvet", "metal"), ("paint", "matte")]


@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_ends_are_exact(one, two):
    for share, expected in ((0.0, one), (1.0, two)):
        mixed = blend(MODELS[one], MODELS[two], share)
        for name in FACTORS:
            np.testing.assert_array_equal(getattr(mixed, name), getattr(MODELS[expected], name))


@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_between_the_ends_numbers_lie_between(one, two):
    first, second = (MODELS[name].sorted_by_width() for name in (one, two))
    for share in (0.1, 0.5, 0.9):
        mixed = blend(MODELS[one], MODELS[two], share)
        for name in FACTORS:
            values, ends = getattr(mixed, name), (getattr(first, name), getattr(second, name))
            assert (values >= np.minimum(*ends) * (1 - 1e-12)).all()
            assert (values <= np.maximum(*ends) * (1 + 1e-12)).all()
            assert np.isfinite(values).all()


@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_no_jump_anywhere(one, two):
    views = np.radians([0, 45, 75])
    shares = [0, 1e-6, 0.25, 0.25 + 1e-6, 1 - 1e-6, 1]
    albedo = [directional_albedo(blend(MODELS[one], MODELS[two], t), views) for t in shares]
    for left, right in ((0, 1), (2, 3), (4, 5)):
        np.testing.assert_allclose(albedo[left], albedo[right], rtol=1e-3, atol=1e-6)
    assert np.abs(albedo[0] - albedo[5]).max() > 0.05


def test_middle_is_the_geometric_mean():
    one, two = MODELS["plastic"], replace(MODELS["plastic"], diffuse=4 * MODELS["plastic"].diffuse)
    middle = blend(one, two, 0.5).diffuse
    np.testing.assert_allclose(middle[2], 2 * one.diffuse[2], rtol=0.02)


def test_lobes_are_matched_by_width():
    one, two = MODELS["plastic"], MODELS["metal"]
    order = [2, 0, 1]
    shuffled = replace(two, scale=two.scale[order], ndf=two.ndf[order], masking=two.masking[order])
    expected, got = blend(one, two, 0.4), blend(one, shuffled, 0.4)
    for name in FACTORS:
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-12)
    widths = [blend(one, two, t).ndf_width() for t in (0, 0.5, 1)]
    assert (np.diff(widths, axis=1) > 0).all()


def test_a_colour_of_nothing_comes_in_over_the_whole_way():
    colors = [mix(np.zeros(1), np.ones(1), t)[0] for t in (0, 0.25, 0.5, 0.75, 1)]
    assert colors[0] == 0
    assert colors[-1] == 1
    assert (np.diff(colors) > 0.01).all()
    assert mix(np.zeros(3), np.zeros(3), 0.5) == pytest.approx(0)


def test_models_of_different_size_cannot_be_matched():
    two = MODELS["metal"]
    fewer = replace(two, scale=two.scale[:2], ndf=two.ndf[:2], masking=two.masking[:2])
    with pytest.raises(ValueError, match="3 and 2 lobes"):
        blend(two, fewer, 0.5)
