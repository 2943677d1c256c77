# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import geometry
from fitter.fitting.problem import Problem
from fitter.grading import metrics


def test_tabulate_at_random_bins(random_model):
    """By the model's own value at the bin's own angles, over all of phi_d."""
    model = random_model(0)
    table = metrics.tabulate(model)
    assert table.shape == (90, 90, 180, 3)
    rng = np.random.default_rng(0)
    h, d = rng.integers(0, 90, (2, 20_000))
    p = np.concatenate([np.arange(180), rng.integers(0, 180, 20_000 - 180)])
    wi, wo = geometry.directions_from_rusinkiewicz(
        geometry.theta_h_centres()[h], geometry.theta_d_centres()[d], geometry.phi_d_centres()[p]
    )
    # a value within rounding of the horizon may fall on either side of it
    clear = (np.abs(wi[:, 2]) > 1e-6) & (np.abs(wo[:, 2]) > 1e-6)
    expected = model.f_r(wi, wo)
    np.testing.assert_allclose(table[h, d, p][clear], expected[clear], rtol=1e-7)
    below = (wi[:, 2] < 0) | (wo[:, 2] < 0)
    assert below.sum() > 1000
    np.testing.assert_array_equal(table[h, d, p][below & clear], 0)


def test_log_error_of_itself_is_zero(two_lobes):
    assert metrics.mean_log_error(two_lobes.f_r, two_lobes) == 0


def test_log_error_of_a_constant_factor(make_measurement):
    # f cos_i = 0.02 everywhere, so every bin has the same error
    cos_i = geometry.merl_bins().cos_i[..., None]
    f_r = np.where(cos_i > 0, 0.02 / np.where(cos_i > 0, cos_i, 1), 0) * np.ones(3)
    measurement = make_measurement(f_r)
    expected = np.log(0.061 / 0.021)
    assert metrics.mean_log_error(3 * f_r, measurement) == pytest.approx(expected, rel=1e-12)
    darker = np.log(0.021 / 0.011)
    assert metrics.mean_log_error(f_r / 2, measurement) == pytest.approx(darker, rel=1e-12)
    # one channel of three
    one = metrics.mean_log_error(f_r * [3, 1, 1], measurement)
    assert one == pytest.approx(expected / 3, rel=1e-12)


def test_log_error_weighs_bins_by_measure_and_skips_invalid_ones(make_measurement):
    cos_i = geometry.merl_bins().cos_i[..., None]
    f_r = np.where(cos_i > 0, 0.02 / np.where(cos_i > 0, cos_i, 1), 0) * np.ones(3)
    valid = np.zeros((90, 90, 180), bool)
    valid[5, 10, 20] = valid[40, 30, 90] = True
    measurement = make_measurement(f_r, valid)
    table = np.where(cos_i > 0, 1e6, f_r)  # where nothing was measured
    table[5, 10, 20], table[40, 30, 90] = f_r[5, 10, 20], 3 * f_r[40, 30, 90]
    measure = geometry.merl_solid_angle()
    share = measure[40, 30] / (measure[40, 30] + measure[5, 10])
    expected = share * np.log(0.061 / 0.021)
    assert metrics.mean_log_error(table, measurement) == pytest.approx(expected, rel=1e-12)


def test_objective_of_a_table_is_that_of_the_fit(planted, two_lobes):
    # which snaps angles to bins
    snapped = Problem(two_lobes, weight="log", phi_group=3, n_angles=720).objective_of(planted)
    got = metrics.relative_objective(metrics.tabulate(planted), two_lobes, "log")
    assert got == pytest.approx(snapped, rel=5e-3)


def test_objective_of_known_tables(two_lobes):
    for factor, expected in ((1, 0), (0, 1), (3, 4)):
        got = metrics.relative_objective(factor * two_lobes.f_r, two_lobes)
        assert got == pytest.approx(expected, rel=1e-12)


def test_objective_skips_invalid_bins(make_measurement, two_lobes):
    valid = np.random.default_rng(0).random((90, 90, 180)) > 0.5
    measurement = make_measurement(two_lobes.f_r, valid)
    table = np.where(valid[..., None], two_lobes.f_r, 1e6)
    assert metrics.relative_objective(table, measurement) == 0
    assert metrics.numeric_psnr(table, measurement) > 200


def test_numeric_psnr(make_measurement):
    rng = np.random.default_rng(0)
    f_r = rng.uniform(1, 2, (90, 90, 180, 3))
    f_r[20, 20, 20, 1] = 5
    measurement = make_measurement(f_r)
    assert metrics.numeric_psnr(f_r + 0.05, measurement) == pytest.approx(40, rel=1e-9)
    # one channel of three
    got = metrics.numeric_psnr(f_r + np.array([0, 0.05, 0]), measurement)
    assert got == pytest.approx(40 + 10 * np.log10(3), rel=1e-9)
