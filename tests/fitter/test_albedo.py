# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fitter import albedo, fit, joint, metrics
from fitter.albedo import AlbedoError
from fitter.tables import directional_albedo


@pytest.fixture(scope="module")
def planted_albedo(planted_measurement):
    return AlbedoError.of(planted_measurement)


def relative_error(model, measurement):
    table = metrics.tabulate(model)
    data = albedo.measured_albedo(measurement.f_r, measurement)
    return np.abs(albedo.measured_albedo(table, measurement) / data - 1)


def test_albedo_of_a_table_is_that_of_the_model(planted, planted_measurement):
    got = albedo.measured_albedo(metrics.tabulate(planted), planted_measurement)
    expected = directional_albedo(planted, np.radians(albedo.VIEW_ANGLES))
    # bins of 1 degree in theta_d against the model itself, and bins cut by the horizon
    np.testing.assert_allclose(got[:-2], expected[:-2], rtol=0.03)


def test_a_perfect_fit_has_no_error(planted, planted_albedo):
    assert planted_albedo.target.shape == (len(albedo.VIEW_ANGLES), 3)
    np.testing.assert_allclose(planted_albedo.albedo(planted), planted_albedo.target, rtol=1e-12)
    assert planted_albedo.value(planted) == pytest.approx(0, abs=1e-20)


def test_large_errors_count_more_than_their_square(planted, planted_albedo):
    def value(share):
        brighter = replace(
            planted, diffuse=(1 + share) * planted.diffuse, scale=(1 + share) * planted.scale
        )
        return planted_albedo.value(brighter)

    assert value(1e-4) == pytest.approx(albedo.WORTH * 1e-8, rel=1e-3)
    assert value(albedo.TOLERANCE) == pytest.approx(2 * albedo.WORTH * albedo.TOLERANCE**2)
    assert value(0.2) > 50 * albedo.WORTH * 0.2**2


def test_jacobian_against_finite_differences(planted_albedo, random_model):
    model = random_model(0)
    layout = joint.Layout.of(model)
    x = layout.pack(model)
    residual, jacobian = planted_albedo.residual_and_jacobian(model)
    assert residual @ residual == pytest.approx(planted_albedo.value(model), rel=1e-12)
    assert jacobian.shape == (54, 822)
    size = np.abs(jacobian).max()
    for k in (*range(0, 822, 41), *range(810, 822)):
        step = np.zeros(822)
        step[k] = 1e-5
        up, down = (
            planted_albedo.residual_and_jacobian(layout.unpack(x + s, model))[0]
            for s in (step, -step)
        )
        np.testing.assert_allclose(jacobian[:, k], (up - down) / 2e-5, atol=1e-7 * size)


def test_bins_without_a_measurement_are_left_out(planted, planted_measurement, make_measurement):
    holes = np.random.default_rng(0).random(planted_measurement.valid.shape) < 0.3
    with_holes = make_measurement(planted_measurement.f_r, planted_measurement.valid & ~holes)
    error = AlbedoError.of(with_holes)
    assert error.value(planted) == pytest.approx(0, abs=1e-20)
    whole = AlbedoError.of(planted_measurement)
    assert (error.target < 0.8 * whole.target).all()


def test_views_without_light_are_left_out(planted, planted_measurement, make_measurement):
    """What is black or not measured has no relative error."""
    for valid, f_r in (
        (np.zeros_like(planted_measurement.valid), planted_measurement.f_r),
        (planted_measurement.valid, planted_measurement.f_r * [1, 1, 0]),
    ):
        error = AlbedoError.of(make_measurement(f_r, valid))
        assert error.target.shape == (0, 3)
        assert error.value(planted) == 0
        residual, jacobian = error.residual_and_jacobian(planted)
        assert residual.shape == (0,)
        assert jacobian.shape == (0, 822)


def test_joint_steps_bring_the_albedo_to_the_data(coarse, two_lobes, random_model):
    start = fit.sweep(coarse, random_model(3), hold_lobes=True, in_order=True)
    start = [m for m, _ in islice(joint.refine(coarse, start, 0.3), 8)][-1]
    error = AlbedoError.of(two_lobes)
    before = first = joint.objective_of(coarse, start, 0.3, error)
    for model, objective in islice(joint.refine(coarse, start, 0.3, error), 8):
        assert objective < before
        assert objective == pytest.approx(joint.objective_of(coarse, model, 0.3, error))
        before = objective
    assert before < first / 2
    largest = [relative_error(m, two_lobes).max() for m in (start, model)]
    assert largest[1] < min(largest[0] / 2, 0.02)
