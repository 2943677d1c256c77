# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import geometry
from fitter.fitting import weights

LEVEL = 0.3  # mean level of the data, 1/sr

# x = f_r cos_i cos_o; the weight is the squared derivative of the curve to f_r. The display
# curve is given up to a constant factor.
CURVES = {
    "display-gamma": (lambda x: 2.2 * (x + 0.05 * LEVEL) ** (1 / 2.2)),
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
    got = weights.WEIGHTS[name](f_r, cos_i, cos_o, LEVEL)
    np.testing.assert_allclose(got, derivative**2, rtol=1e-5)


@pytest.mark.parametrize("name", weights.WEIGHTS)
@pytest.mark.parametrize("value", [0.0, 1e-300, 1e12, 1e30])
def test_weight_is_finite(name, value):
    f_r = np.full(3, value)
    cosines = np.array([1e-9, 0.5, 1.0])
    got = weights.WEIGHTS[name](f_r, cosines, cosines, LEVEL)
    assert got.shape == f_r.shape
    assert np.isfinite(got).all()
    assert (got > 0).all()


@pytest.mark.parametrize("name", weights.WEIGHTS)
def test_weight_is_symmetric_and_broadcasts(name):
    rng = np.random.default_rng(1)
    f_r = rng.random((4, 1, 5))
    cos_i, cos_o = rng.random((2, 4, 1, 5))
    got = weights.WEIGHTS[name](f_r, cos_i, cos_o, LEVEL)
    assert got.shape == f_r.shape
    np.testing.assert_array_equal(got, weights.WEIGHTS[name](f_r, cos_o, cos_i, LEVEL))


def test_sample_weights_look_at_the_mean_of_a_pair(make_measurement):
    """Noise that differs in the two bins of a pair does not change their weights."""
    rng = np.random.default_rng(2)
    f_r = rng.uniform(0.1, 2, (90, 90, 180, 3))
    valid = rng.random(f_r.shape[:3]) > 0.2
    measurement = make_measurement(f_r, valid)
    bins = geometry.merl_bins()
    cosines = np.where(measurement.valid, bins.cos_i * bins.cos_o, 0)
    measure = geometry.merl_solid_angle()[:, :, None] * measurement.valid
    projected = (measure * cosines)[..., None]
    level = (projected * measurement.f_r).sum() / (3 * projected.sum())
    got = list(weights.sample_weights(measurement, "display-gamma"))
    assert len(got) == 3
    both = measurement.valid & measurement.valid[:, :, ::-1]
    for channel, w in enumerate(got):
        rho = measurement.f_r[..., channel]
        mean = np.where(both, (rho + rho[:, :, ::-1]) / 2, rho)
        expected = measure * cosines**2 / (mean * cosines + 0.05 * level) ** (2 - 2 / 2.2)
        np.testing.assert_allclose(w, expected, rtol=1e-9, atol=1e-30)
        assert not w[~measurement.valid].any()
        np.testing.assert_allclose(w[both], w[:, :, ::-1][both], rtol=1e-9)


def test_sample_weights_do_not_depend_on_the_unit(make_measurement):
    """A material ten times as bright gets the same relative weights: pictures are exposed."""
    f_r = np.random.default_rng(3).uniform(0.1, 2, (90, 90, 180, 3))
    dark, bright = make_measurement(f_r), make_measurement(10 * f_r)
    for a, b in zip(
        weights.sample_weights(dark, "display-gamma"),
        weights.sample_weights(bright, "display-gamma"),
        strict=True,
    ):
        np.testing.assert_allclose(b * 10 ** (2 - 2 / 2.2), a, rtol=1e-9)
