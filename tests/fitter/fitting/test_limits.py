# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.fitting import limits, order
from fitter.grading import metrics
from fitter.models.tables import directional_albedo


def test_a_perfect_fit_has_no_error(planted, planted_measurement):
    got = limits.limits(metrics.tabulate(planted), planted_measurement)
    assert got.albedo_error == pytest.approx(0, abs=1e-12)
    assert got.peak_ratio == pytest.approx(1)
    assert set(got.figures()) == {"albedo_error", "peak_ratio"}


def test_errors_of_albedo_and_peak(planted, planted_measurement):
    table = metrics.tabulate(planted)
    table[..., 1] *= 0.9
    got = limits.limits(table, planted_measurement)
    assert got.albedo_error == pytest.approx(0.1)
    table[0, 30, 90, 2] = 5 * planted_measurement.f_r.max()
    assert limits.limits(table, planted_measurement).peak_ratio == pytest.approx(5)


def test_bins_without_a_measurement_are_left_out(planted, planted_measurement, make_measurement):
    table = metrics.tabulate(planted)
    holes = np.random.default_rng(0).random(table.shape[:3]) < 0.1
    measurement = make_measurement(table, ~holes)
    table[holes] = 0
    assert limits.limits(table, measurement).albedo_error == pytest.approx(0, abs=1e-12)
    table[~holes] *= 1.02
    assert limits.limits(table, measurement).albedo_error == pytest.approx(0.02)


def test_energy_is_taken_back_where_there_is_too_much(planted):
    bright = replace(planted, scale=planted.scale * 1.7)
    theta_o = np.radians(np.arange(0, 89.6, 1.7))
    before, after = (directional_albedo(m, theta_o) for m in (bright, limits.within_energy(bright)))
    assert before.max() > 1.05
    assert before.min() < 0.9  # some angles are within it
    assert after.max() <= 1
    assert after.max() > 0.9
    assert (after <= before * (1 + 1e-9)).all()


def test_models_within_the_energy_stay(planted):
    assert limits.within_energy(planted) is planted


def test_values_are_bounded_at_the_horizon(planted):
    """With G zero at 90 degrees, G / cos theta goes to a number there."""
    model = order.order_masking(planted)
    theta = np.pi / 2 - np.array([1e-2, 1e-4, 1e-6, 1e-9])
    ratio = model.evaluate_masking(theta) / np.cos(theta)
    assert (ratio < 1.2 * ratio[:, :1]).all()
    free = replace(planted, masking=np.maximum(planted.masking, 1e-3))
    assert (free.evaluate_masking(theta) / np.cos(theta))[:, -1].min() > 1e5
