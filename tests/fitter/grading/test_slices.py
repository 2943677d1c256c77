# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.grading import metrics, slices
from fitter.grading.slices import INCIDENCE, THETA_O
from tests.models import MODELS


def test_slices_of_the_data_follow_those_of_the_model(make_measurement):
    """A smooth model, tabulated: apart from the width of a bin both are the same curve."""
    model = MODELS["matte"]
    measured = slices.measured_slices(make_measurement(metrics.tabulate(model)))
    expected = slices.model_slices(model)
    assert measured.shape == expected.shape == (len(INCIDENCE), len(THETA_O), 3)
    safe = np.abs(THETA_O) < np.radians(70)
    assert (np.isnan(measured).mean(axis=(1, 2)) < 0.05).all()
    ratio = measured[:3, safe] / expected[:3, safe]
    assert np.median(np.abs(ratio - 1)) < 0.01
    assert np.abs(ratio - 1).max() < 0.2


def test_the_mirror_direction_is_where_theta_o_is_that_of_the_light():
    curves = slices.model_slices(MODELS["metal"])
    for row, theta_i in zip(curves[:3], INCIDENCE, strict=False):
        assert THETA_O[row[:, 1].argmax()] == pytest.approx(theta_i, abs=np.radians(1))


def test_slices_take_the_mean_of_both_orders_and_know_where_nothing_was_measured(make_measurement):
    f_r = np.ones((90, 90, 180, 3))
    f_r[:, :, 179] = 3  # in the plane, with wi and wo swapped
    measured = slices.measured_slices(make_measurement(f_r))
    # at other azimuths there are no other values
    values = measured[~np.isnan(measured)]
    assert set(values.round(6)) <= {1.0, 2.0, 3.0}
    assert (values == 2).mean() > 0.9
    valid = np.ones((90, 90, 180), bool)
    valid[:, :, 179] = False
    one_order = slices.measured_slices(make_measurement(f_r, valid))
    values = one_order[~np.isnan(one_order)]
    assert values.size
    assert (values == 1).all()
    valid[:, :, 0] = False
    assert np.isnan(slices.measured_slices(make_measurement(f_r, valid))).mean() > 0.9
