# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.fitting import prior
from fitter.geometry import theta_d_centres
from fitter.models.anisotropic_model import AnisotropicModel
from tests.models import random_anisotropic

FACTORS = ("ndf", "fresnel", "masking")


@pytest.fixture
def shape_only(monkeypatch):
    """Without the weak term that keeps unseen numbers with their neighbours."""
    monkeypatch.setattr(prior, "LEVEL", dict.fromkeys(FACTORS, 0))


@pytest.fixture
def order_only(monkeypatch, shape_only):
    monkeypatch.setattr(prior, "ROUGHNESS", dict.fromkeys(FACTORS, 0))


@pytest.fixture
def level(random_model):
    """All curves 1."""
    model = random_model(0)
    return replace(model, **{name: np.ones((3, 90)) for name in FACTORS})


def test_level_factors_cost_nothing(level):
    assert prior.disorder(level, 1) == 0


def test_factors_in_order_cost_nothing(order_only, level, planted):
    ordered = replace(planted, masking=np.minimum.accumulate(planted.masking, axis=1))
    assert prior.disorder(ordered, 1) == 0


@pytest.mark.parametrize(
    ("name", "wrong", "right"), [("fresnel", -1, 1), ("masking", 1, -1), ("ndf", None, None)]
)
def test_the_wrong_way_is_counted_whatever_the_number_of_steps(
    order_only, level, name, wrong, right
):
    """A curve that goes back by 0.5 costs about 0.5 of its weight, in one step or in many."""
    if name == "ndf":
        back = 10.0 ** -np.array([0.0, 1.5, 1.0])  # falls, then rises by half a decade
        curves = [np.repeat(back, [1, 40, 49])]
        curves.append(10.0 ** -np.concatenate([np.linspace(0, 1.5, 45), np.linspace(1.5, 1, 45)]))
    else:
        one = np.repeat([1.0, 0.5] if wrong < 0 else [0.5, 1.0], 45)
        many = np.linspace(one[0], one[-1], 90)
        curves = [one, many]
    for curve in curves:
        rows = np.ones((3, 90))
        rows[1] = curve
        got = prior.disorder(replace(level, **{name: rows}), 1)
        expected = prior.WRONG_WAY[name] / 3 * 0.5
        assert 0.8 * expected < got <= 1.001 * expected
        assert prior.disorder(replace(level, **{name: 7 * rows}), 1) == pytest.approx(got)
        if right:
            mirrored = replace(level, **{name: rows[:, ::-1]})
            assert prior.disorder(mirrored, 1) == 0


def test_fresnel_of_schlick_is_in_order(order_only, level):
    schlick = 0.04 + 0.96 * (1 - np.cos(theta_d_centres())) ** 5
    assert prior.disorder(replace(level, fresnel=np.tile(schlick, (3, 1))), 1) == 0


def test_staircases_cost_more_than_slopes(shape_only, level):
    slope = np.linspace(1, 0.1, 90)
    stairs = np.repeat(slope[::10], 10)
    costs = [prior.disorder(replace(level, masking=np.tile(c, (3, 1))), 1) for c in (slope, stairs)]
    assert costs[1] > costs[0] + 0.1


def test_strength_multiplies_all_but_the_level(random_model):
    model = random_model(1)
    weak = prior.disorder(model, 0) / prior.FREE_LEVEL
    assert 0 < weak < 1
    one, two = (prior.disorder(model, s) - weak for s in (1, 2))
    assert two == pytest.approx(2 * one, rel=1e-12)


@pytest.mark.parametrize("name", FACTORS)
def test_slopes_are_those_of_the_cost(random_model, name):
    """2 r dr/dx is the derivative of the cost; a curve's maximum is held, as in the gauge."""
    model = random_model(2).normalized()
    terms = prior.terms(model, 0.7)[name]
    gradient = np.zeros(270)
    np.add.at(gradient, terms.index, 2 * terms.value[:, None] * terms.slope)
    factor = getattr(model, name)
    peaks = {row * 90 + int(curve.argmax()) for row, curve in enumerate(factor)}
    for k in sorted(set(range(0, 270, 13)) - peaks):

        def cost(step, k=k):
            moved = factor.copy()
            moved.flat[k] *= np.exp(step)
            return prior.terms(replace(model, **{name: moved}), 0.7)[name].cost.sum()

        slope = (cost(1e-6) - cost(-1e-6)) / 2e-6
        assert gradient[k] == pytest.approx(slope, rel=1e-4, abs=1e-7)


def test_scales_of_lobes_that_run_away_cost(random_model):
    """Below LARGE_SCALE nothing; beyond, the square of the logarithm, with its slope."""
    model = random_model(2)
    scale = np.full((3, 3), 0.5 * prior.LARGE_SCALE)
    scale[1, 2] = 20 * prior.LARGE_SCALE
    terms = prior.terms(replace(model, scale=scale), 0.0)["scale"]
    expected = np.zeros(9)
    expected[5] = np.log(20)
    np.testing.assert_allclose(terms.cost, prior.EXCESS * expected**2)
    gradient = np.zeros(9)
    np.add.at(gradient, terms.index, 2 * terms.value[:, None] * terms.slope)
    np.testing.assert_allclose(gradient, 2 * prior.EXCESS * expected)


def test_numbers_that_are_zero_have_no_level(random_model):
    model = random_model(3)
    holes = model.ndf.copy()
    holes[0, 30:33] = 0
    got = prior.terms(replace(model, ndf=holes), 0)["ndf"]
    assert np.isfinite(got.cost).all()
    touching = ((got.index >= 30) & (got.index < 33)).any(1)
    assert not got.cost[touching].any()
    assert got.cost[~touching].any()


# --- the tables of the anisotropic model ---


def smooth_anisotropic():
    """Level factors but for G = cos theta, which is in order both ways."""
    table = np.ones((3, 6, 48))
    cosine = np.cos(polar_grid.theta_nodes())[:, None]
    return AnisotropicModel(np.ones(3), np.ones((3, 3)), table, table * cosine, np.ones((3, 90)))


def test_anisotropic_tables_in_order_cost_next_to_nothing():
    assert prior.disorder(smooth_anisotropic(), 1) < 1e-3


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("masking", lambda g: np.where(np.arange(6)[:, None] == 3, 1.5 * g, g)),  # rises
        ("masking", lambda g: g**4),  # falls faster than cos theta
        ("masking", lambda g: g * (1 - 0.3 * (np.arange(48) % 2) * (np.arange(6) > 0)[:, None])),
        ("ndf", lambda d: d * (1 - 0.5 * (np.arange(48) % 2) * (np.arange(6) > 0)[:, None])),
        ("fresnel", lambda f: np.geomspace(1e-4, 1, 90) * f),
    ],
)
def test_what_costs_in_anisotropic_tables(name, change):
    model = smooth_anisotropic()
    changed = replace(model, **{name: change(getattr(model, name))})
    assert prior.disorder(changed, 1) > prior.disorder(model, 1) + 0.05


def test_anisotropic_cost_does_not_depend_on_where_phi_begins():
    model = random_anisotropic(0)
    turned = replace(
        model, ndf=np.roll(model.ndf, 7, axis=2), masking=np.roll(model.masking, 7, axis=2)
    )
    assert prior.disorder(turned, 0.3) == pytest.approx(prior.disorder(model, 0.3), rel=1e-12)


def test_anisotropic_slopes_against_finite_differences():
    """Only where every cost is quadratic in the step is its slope exact: twice slope x value."""
    model = random_anisotropic(1)
    rng = np.random.default_rng(0)
    for name, terms in prior.terms(model, 0.3).items():
        free = getattr(model, name)
        is_table = name in ("ndf", "masking")
        free = model.free_numbers(free) if is_table else free
        derivative = np.zeros(free.size)
        np.add.at(derivative, terms.index, 2 * terms.slope * terms.value[:, None])
        direction = rng.standard_normal(free.shape)
        # the maximum is held: the slopes leave out what a change of the gauge does
        direction[np.arange(len(free)), free.argmax(1)] = 0

        def cost(h, free=free, direction=direction, name=name, is_table=is_table):
            moved = free * np.exp(h * direction)
            moved = model.full_tables(moved) if is_table else moved
            return prior.terms(replace(model, **{name: moved}), 0.3)[name].cost.sum()

        expected = (cost(1e-6) - cost(-1e-6)) / 2e-6
        assert derivative @ direction.ravel() == pytest.approx(expected, rel=1e-4)
