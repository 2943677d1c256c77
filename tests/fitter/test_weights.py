# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import weights

# x = f_r cos_i cos_o; the weight is the squared derivative of the curve to f_r. The display
# curve is given up to a constant factor.
CURVES = {
    "display-gamma": (lambda x: 2.2 * (x + 0.01) ** (1 / 2.2)),
    "log": (lambda x: np.log(x + 0.1)),
    "log1p": np.log1p,
    "linear": (lambda x: x),
}


def test_every_scheme_has_a_curve_here():
    assert set(CURVES) == set(weights.WEIGHTS)
    assert weights.DEFAULT_WEIGHT in weights.WEIGHTS


@pytest.mark.parametrize("name", weights.WEIGHTS)
def test_weight_is_the_squared_derivative_of_the_curve(name):
    rng = np.random.default_rng(0)
    f_r = 10 ** rng.uniform(-3, 3, 200)
    cos_i, cos_o = rng.uniform(0.05, 1, (2, 200))
    product, h = cos_i * cos_o, 1e-5 * f_r
    curve = CURVES[name]
    derivative = (curve((f_r + h) * product) - curve((f_r - h) * product)) / (2 * h)
    got = weights.WEIGHTS[name](f_r, cos_i, cos_o)
    np.testing.assert_allclose(got, derivative**2, rtol=1e-5)


@pytest.mark.parametrize("name", weights.WEIGHTS)
@pytest.mark.parametrize("value", [0.0, 1e-300, 1e12, 1e30])
def test_weight_is_finite(name, value):
    f_r = np.full(3, value)
    cosines = np.array([1e-9, 0.5, 1.0])
    got = weights.WEIGHTS[name](f_r, cosines, cosines)
    assert got.shape == f_r.shape
    assert np.isfinite(got).all()
    assert (got > 0).all()


@pytest.mark.parametrize("name", weights.WEIGHTS)
def test_weight_is_symmetric_and_broadcasts(name):
    rng = np.random.default_rng(1)
    f_r = rng.random((4, 1, 5))
    cos_i, cos_o = rng.random((2, 4, 1, 5))
    got = weights.WEIGHTS[name](f_r, cos_i, cos_o)
    assert got.shape == f_r.shape
    np.testing.assert_array_equal(got, weights.WEIGHTS[name](f_r, cos_o, cos_i))
