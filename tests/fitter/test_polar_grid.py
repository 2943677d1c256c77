# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest

from fitter import polar_grid
from tests.models import bilinear


@pytest.fixture
def tables():
    values = np.random.default_rng(0).uniform(0.1, 2, (2, 6, 48))
    values[:, 0] = values[:, :1, 0]
    return values


def test_solid_angles_fill_the_hemisphere():
    areas = polar_grid.solid_angles()
    assert areas.shape == (288,)
    assert areas.sum() == pytest.approx(2 * math.pi, rel=1e-12)
    cap = 2 * math.pi * (1 - math.cos(math.radians(7.5)))
    assert areas[:48].sum() == pytest.approx(cap, rel=1e-12)


def test_directions_are_where_the_nodes_say():
    w = polar_grid.directions()
    np.testing.assert_allclose(w[:48], np.tile([0.0, 0.0, 1.0], (48, 1)), atol=1e-15)
    # theta 30 degrees, phi 90: the third row, column 12
    np.testing.assert_allclose(w[2 * 48 + 12], [0, 0.5, math.sqrt(0.75)], atol=1e-15)


def test_nodes_are_reproduced(tables):
    theta, phi = np.meshgrid(polar_grid.theta_nodes(), polar_grid.phi_nodes(), indexing="ij")
    got = polar_grid.interpolate(tables, theta.ravel(), phi.ravel()).reshape(tables.shape)
    np.testing.assert_allclose(got, tables, rtol=1e-12)


def test_bilinear_and_periodic(tables):
    rng = np.random.default_rng(1)
    theta, phi = rng.uniform(0, np.pi / 2, 500), rng.uniform(-np.pi, 3 * np.pi, 500)
    got = polar_grid.interpolate(tables, theta, phi)
    expected = [[bilinear(t, a, b) for a, b in zip(theta, phi, strict=True)] for t in tables]
    np.testing.assert_allclose(got, expected, rtol=1e-10)


@pytest.mark.parametrize("turns", [-1, 1, 3])
def test_a_whole_turn_changes_nothing(tables, turns):
    rng = np.random.default_rng(2)
    theta, phi = rng.uniform(0, np.pi / 2, 500), rng.uniform(0, 2 * np.pi, 500)
    turned = polar_grid.interpolate(tables, theta, phi + turns * 2 * np.pi)
    np.testing.assert_allclose(turned, polar_grid.interpolate(tables, theta, phi), rtol=1e-12)


def test_the_azimuth_means_nothing_at_the_pole(tables):
    phi = np.linspace(-4, 4, 100)
    at_pole = polar_grid.interpolate(tables, np.zeros(100), phi)
    np.testing.assert_allclose(at_pole, np.repeat(tables[:, 0, :1], 100, axis=1), rtol=1e-14)
    # and next to it no more than the distance to it
    near = polar_grid.interpolate(tables, np.full(100, 1e-6), phi)
    assert np.abs(near - at_pole).max() < 1e-5


def test_linear_to_zero_at_the_horizon(tables):
    ends = np.radians([75.0, 80.0, 85.0, 90.0])
    got = polar_grid.interpolate(tables, ends, np.zeros(4))
    np.testing.assert_allclose(got, tables[:, 5, :1] * [1, 2 / 3, 1 / 3, 0], atol=1e-14)


def test_weights_are_a_partition_up_to_the_last_row():
    rng = np.random.default_rng(3)
    theta, phi = rng.uniform(0, polar_grid.LAST_THETA, 1000), rng.uniform(-9, 9, 1000)
    taps = polar_grid.taps(theta, phi)
    assert taps.index.min() >= 0
    assert taps.index.max() < polar_grid.N_NODES
    assert taps.weight.min() >= 0
    np.testing.assert_allclose(taps.weight.sum(0), 1, rtol=1e-12)
