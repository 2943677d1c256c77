# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import synthetic
from fitter.baselines import principled
from fitter.baselines.principled import Principled
from fitter.geometry import half_angles
from fitter.grading import metrics

# nothing in Blender uses the models of others
pytestmark = pytest.mark.one_version

PLASTIC = Principled(np.array([0.1, 0.05, 0.01]), np.array([0.04, 0.05, 0.06]), np.ones(3), 0.12)
METAL = Principled(np.zeros(3), np.array([0.9, 0.6, 0.4]), np.array([0.9, 0.8, 0.7]), 0.03)


def test_formula(upper_directions):
    """Against Walter et al. 2007 with tangents, as the paper prints them."""
    rng = np.random.default_rng(0)
    wi, wo = upper_directions(rng, 100), upper_directions(rng, 100)
    keep = (wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3)
    wi, wo = wi[keep], wo[keep]
    theta_h, theta_d = half_angles(wi, wo)
    alpha2 = PLASTIC.alpha**2
    tangent = np.tan(theta_h)
    ndf = alpha2 / (np.pi * np.cos(theta_h) ** 4 * (alpha2 + tangent**2) ** 2)
    lambdas = [(np.sqrt(1 + alpha2 * (1 / w[:, 2] ** 2 - 1)) - 1) / 2 for w in (wi, wo)]
    lobe = ndf / (1 + sum(lambdas)) / (4 * wi[:, 2] * wo[:, 2])
    fresnel = PLASTIC.f0 + (1 - PLASTIC.f0) * (1 - np.cos(theta_d))[:, None] ** 5
    expected = PLASTIC.diffuse + fresnel * lobe[:, None]
    np.testing.assert_allclose(PLASTIC.f_r(wi, wo), expected, rtol=1e-9)


def test_black_below_the_horizon():
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
    np.testing.assert_array_equal(PLASTIC.f_r(up, down), 0)
    np.testing.assert_array_equal(PLASTIC.f_r(down, up), 0)
    assert PLASTIC.n_parameters == 10


@pytest.mark.parametrize("planted", [PLASTIC, METAL], ids=["plastic", "metal"])
def test_recovery(make_measurement, planted):
    fitted = principled.fit(make_measurement(metrics.tabulate(planted)))
    assert fitted.alpha == pytest.approx(planted.alpha, rel=0.01)
    for name in ("diffuse", "f0", "f90"):
        np.testing.assert_allclose(
            getattr(fitted, name), getattr(planted, name), rtol=0.02, atol=2e-4
        )


def test_reflectances_stay_within_0_and_1(make_measurement):
    table = metrics.tabulate(replace(PLASTIC, f0=np.array([1.5, 0.5, 0.5]), f90=np.full(3, 3.0)))
    fitted = principled.fit(make_measurement(table))
    for name in ("f0", "f90"):
        assert ((getattr(fitted, name) >= 0) & (getattr(fitted, name) <= 1)).all()
    assert (fitted.diffuse >= 0).all()
    assert (fitted.f90 == 1).all()


def test_bounded_solution_is_the_least():
    rng = np.random.default_rng(0)
    factors = rng.normal(size=(200, 3, 4))
    matrix = factors @ factors.transpose(0, 2, 1)
    right = rng.normal(size=(200, 3)) * 3
    x, least = principled._solve_bounded(matrix, right)
    assert (x >= 0).all()
    assert (x[:, 1:] <= 1).all()

    def value(y):
        return np.einsum("ni,nij,nj->n", y, matrix, y) - 2 * (right * y).sum(-1)

    np.testing.assert_allclose(value(x), least, rtol=1e-9, atol=1e-9)
    for _ in range(300):
        nearby = np.maximum(x + rng.normal(size=x.shape) * 10 ** rng.uniform(-4, 0), 0)
        nearby[:, 1:] = np.minimum(nearby[:, 1:], 1)
        assert (value(nearby) >= least - 1e-9).all()
    assert 0.05 < (x[:, 1:] == 1).mean() < 0.95


def test_other_weight(make_measurement):
    measurement = make_measurement(*synthetic.tabulate(synthetic.SAMPLES["copper-paint"]))
    errors = {}
    for weight in ("display-gamma", "linear"):
        table = metrics.tabulate(principled.fit(measurement, weight=weight))
        for judge in ("display-gamma", "linear"):
            errors[weight, judge] = metrics.relative_objective(table, measurement, judge)
    assert errors["linear", "linear"] < errors["display-gamma", "linear"]
    assert errors["display-gamma", "display-gamma"] < errors["linear", "display-gamma"]
