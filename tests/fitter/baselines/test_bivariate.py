# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import geometry
from fitter.baselines import bivariate
from fitter.baselines.bivariate import Bivariate
from fitter.fitting.weights import sample_weights
from fitter.grading import metrics

# nothing in Blender uses the models of others
pytestmark = pytest.mark.one_version


@pytest.fixture(scope="module")
def smooth():
    """A table that is bilinear over the positions of the bins, so look-ups of it are exact."""
    h, d = np.meshgrid(np.arange(90), np.arange(90), indexing="ij")
    channels = [1 + 0.01 * h + 0.02 * d, 2 + 1e-3 * h * d, 0.5 + 0.03 * d]
    return Bivariate(np.stack(channels, -1))


def test_is_reached_by_swapping_the_directions(smooth, upper_directions):
    rng = np.random.default_rng(0)
    wi, wo = upper_directions(rng, 200), upper_directions(rng, 200)
    np.testing.assert_allclose(smooth.f_r(wi, wo), smooth.f_r(wo, wi), rtol=1e-12)


def test_bilinear_between_bin_centres(smooth):
    # a quarter of a bin on from the centres of theta_h 30 and theta_d 20
    theta_h, theta_d = ((30.75) / 90) ** 2 * np.pi / 2, np.radians(20.75)
    wi, wo = geometry.directions_from_rusinkiewicz(theta_h, theta_d, np.array([1.0]))
    h, d = 30.25, 20.25
    expected = [1 + 0.01 * h + 0.02 * d, 2 + 1e-3 * h * d, 0.5 + 0.03 * d]
    np.testing.assert_allclose(smooth.f_r(wi, wo), [expected], rtol=1e-10)


def test_constant_beyond_the_outer_centres(smooth):
    up = np.array([[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(smooth.f_r(up, up), smooth.table[:1, 0], rtol=1e-14)


def test_black_below_the_horizon(smooth):
    up, down = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
    np.testing.assert_array_equal(smooth.f_r(up, down), 0)
    np.testing.assert_array_equal(smooth.f_r(down, up), 0)


def test_number_of_parameters(smooth):
    assert smooth.n_parameters == 24300


def test_table_is_recovered(smooth, make_measurement):
    planted = metrics.tabulate(smooth)
    fitted = bivariate.fit(make_measurement(planted))
    valid = geometry.merl_bins().above_horizon
    np.testing.assert_allclose(metrics.tabulate(fitted)[valid], planted[valid], rtol=1e-10)


def test_cell_is_the_weighted_mean(make_measurement):
    rng = np.random.default_rng(1)
    measurement = make_measurement(rng.uniform(0.1, 2, (90, 90, 180, 3)))
    fitted = bivariate.fit(measurement, weight="log")
    weights = list(sample_weights(measurement, "log"))
    for h, d in ((0, 10), (40, 40), (70, 30)):
        valid = measurement.valid[h, d]
        for c in range(3):
            rho = measurement.f_r[h, d, valid, c]
            w = weights[c][h, d, valid]
            assert fitted.table[h, d, c] == pytest.approx((w * rho).sum() / w.sum(), rel=1e-12)


def test_empty_cells_take_the_nearest(smooth, make_measurement):
    planted = metrics.tabulate(smooth)
    valid = np.ones(planted.shape[:3], bool)
    valid[40:43, 20] = False
    fitted = bivariate.fit(make_measurement(planted, valid))
    np.testing.assert_allclose(fitted.table[40, 20], smooth.table[39, 20], rtol=1e-10)
    assert np.abs(fitted.table[41, 20] - smooth.table[41, 20]).max() < 0.05
    # the corner where no pair of directions exists is not left black
    assert (fitted.table > 0).all()
