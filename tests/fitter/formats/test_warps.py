# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.formats.warps import SquareTable, Warp

ANGLES = np.array([-1.0, 0.0, 2.0])
ELEVATIONS = np.array([0.0, 0.5])


@pytest.fixture(scope="module")
def rng():
    return np.random.default_rng(3)


@pytest.fixture(scope="module")
def uniform(rng):
    return rng.random((2, 2000))


@pytest.fixture(scope="module")
def parameters(rng):
    """Inside, outside and at the nodes."""
    angles = rng.uniform(-2, 3, 2000)
    angles[:3] = ANGLES
    return angles, rng.uniform(-0.2, 0.7, 2000)


@pytest.fixture(scope="module")
def values(rng):
    return rng.random((3, 2, 5, 7)) ** 3


def test_table_at_its_nodes(values):
    y, x = (axis.ravel() for axis in np.mgrid[0:5, 0:7])
    for a, e in np.ndindex(3, 2):
        found = SquareTable(values, (ANGLES, ELEVATIONS)).eval(
            x / 6, y / 4, np.full(35, ANGLES[a]), np.full(35, ELEVATIONS[e])
        )
        np.testing.assert_allclose(found, values[a, e].ravel(), rtol=1e-13)


def test_table_is_linear_in_every_direction(uniform, parameters):
    """A function that is linear in each argument is found exactly, and held beyond the nodes."""

    def f(x, y, a, e):
        return 1 + 2 * x - y + 3 * x * y + a - 4 * e + a * e

    y, x = np.mgrid[0:1:5j, 0:1:7j]
    nodes = f(x, y, ANGLES[:, None, None, None], ELEVATIONS[None, :, None, None])
    found = SquareTable(nodes, (ANGLES, ELEVATIONS)).eval(*uniform, *parameters)
    angles, elevations = parameters
    wanted = f(*uniform, np.clip(angles, -1, 2), np.clip(elevations, 0, 0.5))
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_table_of_channels(values, uniform, parameters):
    channels = np.stack([values, 2 * values, -values], -1)
    nodes = (ANGLES, ELEVATIONS)
    found = SquareTable(channels, nodes).eval(*uniform, *parameters)
    single = SquareTable(values, nodes).eval(*uniform, *parameters)
    np.testing.assert_allclose(found, single[:, None] * [1, 2, -1], rtol=1e-13)


def test_parameter_of_one_node_does_not_matter(values, uniform):
    table = SquareTable(values[:1, :1], (ANGLES[:1], ELEVATIONS[:1]))
    found = table.eval(*uniform, np.full(2000, 7.0), np.full(2000, -7.0))
    np.testing.assert_array_equal(found, SquareTable(values[0, 0]).eval(*uniform))


def test_sample_and_invert_are_inverse(values, uniform, parameters):
    warp = Warp(values, (ANGLES, ELEVATIONS))
    position = warp.sample(*uniform, *parameters)
    np.testing.assert_allclose(warp.invert(*position, *parameters), uniform, atol=1e-9)


def test_density_integrates_to_one(values):
    x, y = ((np.arange(600) + 0.5) / 600, (np.arange(400) + 0.5) / 400)
    x, y = (axis.ravel() for axis in np.meshgrid(x, y))
    warp = Warp(values, (ANGLES, ELEVATIONS))
    for angle, elevation in ((-1.0, 0.0), (0.7, 0.2)):
        density = warp.eval(x, y, np.full(x.size, angle), np.full(x.size, elevation))
        assert density.mean() == pytest.approx(1, rel=1e-4)


def test_invert_is_the_integral_of_the_density(values):
    """Its Jacobian is the density: that is what makes it the warp of this density."""
    warp = Warp(values[1, 1])
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0.01, 0.99, (2, 500))
    step = 1e-6
    left, right = (np.array(warp.invert(x + s, y)) for s in (-step, step))
    below, above = (np.array(warp.invert(x, y + s)) for s in (-step, step))
    dx, dy = (right - left) / (2 * step), (above - below) / (2 * step)
    jacobian = dx[0] * dy[1] - dx[1] * dy[0]
    np.testing.assert_allclose(jacobian, warp.eval(x, y), rtol=1e-4)


def test_scale_of_the_values_does_not_matter(values, uniform):
    first, second = Warp(values[0, 0]), Warp(1000 * values[0, 0])
    np.testing.assert_allclose(first.invert(*uniform), second.invert(*uniform), rtol=1e-12)


def test_zero_patches_and_slices_give_numbers(uniform):
    values = np.zeros((2, 4, 4))
    values[0, 1, 1] = 1
    warp = Warp(values, (np.array([0.0, 1.0]),))
    for parameter in (0.0, 1.0):
        result = warp.invert(*uniform, np.full(2000, parameter))
        assert np.isfinite(result).all()
    position = np.array(warp.sample(*uniform, np.zeros(2000)))
    assert (position <= 2 / 3 + 1e-9).all()


def test_level_and_steep_patches_sample_alike():
    """Where the density barely changes along a patch, the inverse of its integral has no gap."""
    t = np.linspace(0, 1, 50)
    for slope in (0.0, 1e-15, 1e-9, 1e-4, 0.5):
        row = np.array([1 - slope, 1 + slope])
        warp = Warp(np.stack([row, row]))
        x, _ = warp.invert(*warp.sample(t, t))
        np.testing.assert_allclose(x, t, atol=1e-12)
