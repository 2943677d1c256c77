# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.models import splines

HALF_PI = np.pi / 2
STEP = HALF_PI / 89


def curves(n, seed=0):
    return np.random.default_rng(seed).uniform(0.2, 1, (n, 90))


def hermite(points, theta):
    """Catmull-Rom as a cubic Hermite curve with central differences as slopes."""
    padded = np.concatenate([[points[1]], points, [2 * points[-1] - points[-2]]])
    position = theta / STEP
    k = min(int(position), 88)
    t = position - k
    p0, p1 = padded[k + 1], padded[k + 2]
    m0, m1 = (padded[k + 2] - padded[k]) / 2, (padded[k + 3] - padded[k + 1]) / 2
    return (
        (1 + 2 * t) * (1 - t) ** 2 * p0
        + t * (1 - t) ** 2 * m0
        + t * t * (3 - 2 * t) * p1
        + t * t * (t - 1) * m1
    )


def test_nodes():
    nodes = splines.masking_nodes()
    assert nodes[0] == 0
    assert nodes[-1] == HALF_PI
    np.testing.assert_allclose(np.diff(nodes), np.radians(90 / 89), rtol=1e-12)


def test_curve_passes_through_control_points():
    points = curves(2)
    got = splines.evaluate(points, splines.masking_nodes())
    np.testing.assert_allclose(got, points, rtol=1e-12)


@pytest.mark.parametrize("segment", [0, 1, 2, 45, 87, 88])
def test_curve_is_the_hermite_form(segment):
    points = curves(1)
    theta = (segment + np.linspace(0, 1, 11)) * STEP
    theta = np.minimum(theta, HALF_PI)
    got = splines.evaluate(points, theta)[0]
    np.testing.assert_allclose(got, [hermite(points[0], t) for t in theta], rtol=1e-11)


def test_linear_functions_are_reproduced():
    # from the second segment on: the mirror image at 0 bends a line in the first
    theta = np.linspace(STEP, HALF_PI, 500)
    points = 2 - splines.masking_nodes()[None]
    np.testing.assert_allclose(splines.evaluate(points, theta)[0], 2 - theta, rtol=1e-13)
    np.testing.assert_allclose(splines.evaluate(np.ones((1, 90)), theta)[0], 1, rtol=1e-14)


def test_matrix_and_taps_give_the_same_curve():
    points = curves(3)
    theta = np.concatenate([np.linspace(0, HALF_PI, 777), splines.masking_nodes()])
    taps = splines.catmull_rom_taps(theta)
    assert taps.index.shape == taps.weight.shape == (4, *theta.shape)
    assert taps.index.min() == 0
    assert taps.index.max() == 89
    by_taps = (points[:, taps.index] * taps.weight).sum(1)
    by_matrix = points @ splines.catmull_rom_taps(theta).matrix().T
    np.testing.assert_allclose(by_taps, splines.evaluate(points, theta), rtol=1e-14)
    np.testing.assert_allclose(by_matrix, by_taps, rtol=1e-13)


def test_weights_sum_to_one():
    taps = splines.catmull_rom_taps(np.linspace(0, HALF_PI, 1000))
    np.testing.assert_allclose(taps.weight.sum(0), 1, rtol=1e-14)


@pytest.mark.parametrize("node", [1, 2, 3, 44, 86, 87, 88])
def test_slope_is_continuous_across_a_node(node):
    points = curves(1)
    at, h = splines.masking_nodes()[node], 1e-6
    left, middle, right = splines.evaluate(points, np.array([at - h, at, at + h]))[0]
    slope = (points[0, node + 1] - points[0, node - 1]) / 2 / STEP
    assert (middle - left) / h == pytest.approx(slope, abs=2e-2)
    assert (right - middle) / h == pytest.approx(slope, abs=2e-2)


def test_mirrored_at_the_normal():
    points, h = curves(1), 1e-6
    at, beside = splines.evaluate(points, np.array([0, h]))[0]
    assert abs(beside - at) / h < 1e-2  # slope 0; elsewhere it is about 10
    beyond = splines.evaluate(points, np.array([-0.3]))[0]
    assert beyond[0] == at  # clamped


def test_continued_as_a_line_at_the_horizon():
    points, h = curves(1), 1e-6
    at, before, beyond = splines.evaluate(points, np.array([HALF_PI, HALF_PI - h, 2]))[0]
    slope = (points[0, 89] - points[0, 88]) / STEP
    assert (at - before) / h == pytest.approx(slope, abs=2e-2)
    assert beyond == at  # clamped


def test_curve_is_never_negative():
    points = np.zeros((1, 90))
    points[0, ::3] = 1
    theta = np.linspace(0, HALF_PI, 2000)
    unclamped = points @ splines.catmull_rom_taps(theta).matrix().T
    assert unclamped.min() < -0.05
    got = splines.evaluate(points, theta)
    assert got.min() == 0
    np.testing.assert_allclose(got, np.maximum(unclamped, 0), atol=1e-15)
