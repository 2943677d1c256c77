# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fitter.fitting import albedo, appearance, fit, joint
from fitter.fitting.appearance import AppearanceError
from fitter.geometry import N_PHI_D
from fitter.grading import metrics


@pytest.fixture(scope="module")
def planted_appearance(planted_measurement):
    return AppearanceError.of(planted_measurement, 1)


@pytest.fixture(scope="module")
def planted_albedo(planted_measurement):
    return AppearanceError.of(planted_measurement, 0)


def brighter(model, share):
    return replace(model, diffuse=(1 + share) * model.diffuse, scale=(1 + share) * model.scale)


def relative_error(model, measurement):
    table = metrics.tabulate(model)
    data = albedo.measured_albedo(measurement.f_r, measurement)
    return np.abs(albedo.measured_albedo(table, measurement) / data - 1)


def test_a_perfect_fit_has_no_error(planted, planted_appearance):
    lights = 1 + appearance.TURNS
    seen = planted_appearance.seen(planted)
    assert seen.shape == (len(albedo.VIEW_ANGLES), lights, 3)
    np.testing.assert_allclose(seen[:, 0], planted_appearance.albedo, rtol=1e-6)
    assert planted_appearance.value(planted) == pytest.approx(0, abs=1e-15)


def test_the_first_light_shows_the_albedo(planted_measurement, planted_albedo):
    expected = albedo.measured_albedo(planted_measurement.f_r, planted_measurement)
    np.testing.assert_allclose(planted_albedo.albedo, expected, rtol=0.01)


def test_large_errors_of_the_albedo_count_more_than_their_square(planted, planted_albedo):
    def value(share):
        return planted_albedo.value(brighter(planted, share))

    worth = appearance.ALBEDO_WORTH
    assert value(1e-4) == pytest.approx(worth * 1e-8, rel=1e-2)
    assert value(appearance.TOLERANCE) == pytest.approx(
        2 * worth * appearance.TOLERANCE**2, rel=1e-3
    )
    assert value(0.2) > 50 * worth * 0.2**2


def test_pixels_are_compared_as_displayed(planted, planted_appearance, planted_albedo):
    """Where nothing is clipped, 1 % more light is 1 % / 2.2 more of the display value."""
    share = 1e-4
    model = brighter(planted, share)
    pixels = planted_appearance.value(model) - planted_albedo.value(model)
    unclipped = appearance.PICTURE_WORTH * (share / appearance.DISPLAY_GAMMA) ** 2
    assert 0.3 * unclipped < pixels < 1.01 * unclipped


def test_pixels_are_exposed_as_a_picture(planted_appearance):
    """The mean of the linear values before clipping is that of sphere.py."""
    assert planted_appearance.pixels.max() == 1
    assert 0.3 < (planted_appearance.pixels**appearance.DISPLAY_GAMMA).mean() / 0.3 < 1.1


def test_jacobian_against_finite_differences(planted_appearance, random_model):
    model = random_model(0)
    # as bright as the data, or every pixel is clipped
    seen = planted_appearance.seen(model)[:, 0].mean()
    model = brighter(model, planted_appearance.albedo.mean() / seen - 1)
    layout = joint.Layout.of(model)
    x = layout.pack(model)
    residual, jacobian = planted_appearance.residual_and_jacobian(model)
    assert residual @ residual == pytest.approx(planted_appearance.value(model), rel=1e-6)
    assert jacobian.shape == (18 * (1 + appearance.TURNS) * 3, 822)
    assert (np.abs(jacobian) > 0).any(1).mean() > 0.8
    size = np.abs(jacobian).max()
    for k in (*range(0, 822, 41), *range(810, 822)):
        step = np.zeros(822)
        step[k] = 1e-5
        up, down = (
            planted_appearance.residual_and_jacobian(layout.unpack(x + s, model))[0]
            for s in (step, -step)
        )
        np.testing.assert_allclose(jacobian[:, k], (up - down) / 2e-5, atol=1e-5 * size)


def test_files_that_are_not_mirror_symmetric_show_their_mean(planted, make_measurement):
    """Light comes from both sides, and a model is the same on both."""
    tilt = np.linspace(-0.5, 0.5, N_PHI_D)[:, None]
    table = metrics.tabulate(planted)
    tilted = AppearanceError.of(make_measurement(table * (1 + tilt)), 1)
    assert tilted.value(planted) == pytest.approx(0, abs=1e-15)


def test_bins_without_a_measurement_are_left_out(planted, planted_measurement, make_measurement):
    holes = np.random.default_rng(0).random(planted_measurement.valid.shape) < 0.3
    f_r = planted_measurement.f_r
    error = AppearanceError.of(make_measurement(f_r, planted_measurement.valid & ~holes), 1)
    whole = AppearanceError.of(planted_measurement, 1)
    assert (error.albedo < 0.8 * whole.albedo).all()
    assert error.value(planted) == pytest.approx(0, abs=1e-15)


def test_views_without_light_are_left_out(planted, planted_measurement, make_measurement):
    """What is black or not measured has no relative error."""
    for valid, f_r in (
        (np.zeros_like(planted_measurement.valid), planted_measurement.f_r),
        (planted_measurement.valid, planted_measurement.f_r * [1, 1, 0]),
    ):
        error = AppearanceError.of(make_measurement(f_r, valid), 1)
        assert error.albedo.shape == (0, 3)
        assert error.value(planted) == 0
        residual, jacobian = error.residual_and_jacobian(planted)
        assert residual.shape == (0,)
        assert jacobian.shape == (0, 822)


def test_joint_steps_bring_the_appearance_to_the_data(coarse, two_lobes, random_model):
    start = fit.sweep(coarse, random_model(3), hold_lobes=True, in_order=True)
    start = [m for m, _ in islice(joint.refine(coarse, start, 0.3), 8)][-1]
    error = AppearanceError.of(two_lobes, 2)
    before = first = joint.objective_of(coarse, start, 0.3, error)
    for model, objective in islice(joint.refine(coarse, start, 0.3, error), 8):
        assert objective < before
        assert objective == pytest.approx(joint.objective_of(coarse, model, 0.3, error))
        before = objective
    assert before < first / 2
    assert error.value(model) < error.value(start) / 4
    largest = [relative_error(m, two_lobes).max() for m in (start, model)]
    assert largest[1] < min(largest[0] / 2, 0.02)
