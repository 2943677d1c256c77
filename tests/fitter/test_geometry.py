# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import geometry

N_PAIRS = 20_000


def random_directions(rng, n):
    """Uniform on the upper hemisphere; every fourth within a thousandth of the horizon."""
    z = rng.random(n)
    z[::4] *= 1e-3
    phi = rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)


def random_pairs(seed=0):
    rng = np.random.default_rng(seed)
    return random_directions(rng, N_PAIRS), random_directions(rng, N_PAIRS)


def rotated_about_normal(vectors, angle):
    x, y, z = np.moveaxis(vectors, -1, 0)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], -1)


def pair_invariants(wi, wo):
    """All that a rotation about the normal leaves of a pair, handedness included."""
    turn = wi[..., 0] * wo[..., 1] - wi[..., 1] * wo[..., 0]
    return np.stack([wi[..., 2], wo[..., 2], (wi * wo).sum(-1), turn], -1)


def test_directions_to_coordinates_and_back():
    wi, wo = random_pairs()
    again_i, again_o = geometry.directions_from_rusinkiewicz(
        *geometry.rusinkiewicz_from_directions(wi, wo)
    )
    got = pair_invariants(again_i, again_o)
    as_given = np.abs(got - pair_invariants(wi, wo)).max(-1)
    swapped = np.abs(got - pair_invariants(wo, wi)).max(-1)
    assert np.minimum(as_given, swapped).max() < 1e-12
    # about half of the pairs are folded: neither case may be missing
    assert 0.4 < np.mean(as_given < 1e-12) < 0.6
    assert 0.4 < np.mean(swapped < 1e-12) < 0.6


def test_directions_from_coordinates_are_unit():
    rng = np.random.default_rng(1)
    wi, wo = geometry.directions_from_rusinkiewicz(
        rng.uniform(0, np.pi / 2, 1000),
        rng.uniform(0, np.pi / 2, 1000),
        rng.uniform(0, np.pi, 1000),
    )
    np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(wo, axis=-1), 1, rtol=1e-14)


@pytest.mark.parametrize("azimuth", [0.0, 1.0, 2.5, 4.0, 6.0])
def test_coordinates_to_directions_and_back(azimuth):
    rng = np.random.default_rng(2)
    theta_h = rng.uniform(1e-3, np.pi / 2, N_PAIRS)
    theta_d = rng.uniform(1e-3, np.pi / 2 - 1e-3, N_PAIRS)
    phi_d = rng.uniform(1e-6, np.pi - 1e-6, N_PAIRS)
    wi, wo = geometry.directions_from_rusinkiewicz(theta_h, theta_d, phi_d)
    got = geometry.rusinkiewicz_from_directions(
        rotated_about_normal(wi, azimuth), rotated_about_normal(wo, azimuth)
    )
    for value, expected in zip(got, (theta_h, theta_d, phi_d), strict=True):
        np.testing.assert_allclose(value, expected, rtol=0, atol=1e-9)


def test_known_coordinates():
    # wi at 70 degrees and wo at 10 in one azimuth: h at 40, wi on the side away from the normal
    def direction(degrees):
        return np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])

    got = geometry.rusinkiewicz_from_directions(direction(70), direction(10))
    np.testing.assert_allclose(got, np.radians([40, 30, 0]), atol=1e-12)
    wi, wo = geometry.directions_from_rusinkiewicz(*np.radians([40, 30, 0]))
    np.testing.assert_allclose(wi, direction(70), atol=1e-15)
    np.testing.assert_allclose(wo, direction(10), atol=1e-15)

    # h at the normal and wi across the x-z plane
    wi = np.array([0, np.sin(0.5), np.cos(0.5)])
    got = geometry.rusinkiewicz_from_directions(wi, wi * [1, -1, 1])
    np.testing.assert_allclose(got, [0, 0.5, np.pi / 2], atol=1e-15)


def test_half_angles_are_symmetric_to_the_last_bit():
    wi, wo = random_pairs(3)
    np.testing.assert_array_equal(geometry.half_angles(wi, wo), geometry.half_angles(wo, wi))
    np.testing.assert_array_equal(
        geometry.rusinkiewicz_from_directions(wi, wo)[:2],
        geometry.rusinkiewicz_from_directions(wo, wi)[:2],
    )


def test_phi_d_is_folded():
    wi, wo = random_pairs(4)
    phi_d = geometry.rusinkiewicz_from_directions(wi, wo)[2]
    assert (phi_d >= 0).all()
    assert (phi_d < np.pi).all()
    assert phi_d.min() < 0.01
    assert phi_d.max() > np.pi - 0.01
    swapped = geometry.rusinkiewicz_from_directions(wo, wi)[2]
    difference = np.abs(phi_d - swapped)
    assert np.minimum(difference, np.pi - difference).max() < 1e-9


def test_phi_d_never_rounds_up_to_pi():
    wi, wo = geometry.directions_from_rusinkiewicz(0.5, 0.3, 0.0)
    wi[1], wo[1] = -1e-300, 1e-300
    assert geometry.rusinkiewicz_from_directions(wi, wo)[2] == 0


@pytest.mark.parametrize("shape", [(), (5,), (2, 3)])
def test_coordinates_broadcast(shape):
    wi, wo = geometry.directions_from_rusinkiewicz(np.full(shape, 0.3), 0.2, 0.1)
    assert wi.shape == wo.shape == (*shape, 3)
    for value in geometry.rusinkiewicz_from_directions(wi, wo):
        assert np.shape(value) == shape


def test_theta_h_axis():
    assert geometry.theta_h_from_index(0) == 0
    np.testing.assert_allclose(geometry.theta_h_from_index(45), np.pi / 8)
    np.testing.assert_allclose(geometry.theta_h_from_index(90), np.pi / 2)
    np.testing.assert_allclose(
        np.degrees(geometry.theta_h_centres()[[0, 89]]), [1 / 360, 89.0028], rtol=1e-6
    )
    np.testing.assert_allclose(
        geometry.index_from_theta_h(geometry.theta_h_centres()), np.arange(90) + 0.5
    )
    np.testing.assert_allclose(np.degrees(geometry.theta_d_centres()), np.arange(90) + 0.5)
    np.testing.assert_allclose(np.degrees(geometry.phi_d_centres()), np.arange(180) + 0.5)


@pytest.fixture(scope="module")
def centre_directions():
    return geometry.directions_from_rusinkiewicz(
        geometry.theta_h_centres()[:, None, None],
        geometry.theta_d_centres()[:, None],
        geometry.phi_d_centres(),
    )


def test_merl_bins_are_the_cosines_of_the_directions(centre_directions):
    wi, wo = centre_directions
    bins = geometry.merl_bins()
    np.testing.assert_allclose(bins.cos_i, wi[..., 2], rtol=0, atol=1e-15)
    np.testing.assert_allclose(bins.cos_o, wo[..., 2], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(bins.above_horizon, (wi[..., 2] > 0) & (wo[..., 2] > 0))
    # some 3/4 of the grid; both directions of the inequality occur
    assert 1_090_000 < np.count_nonzero(bins.above_horizon) < 1_100_000


@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_every_centre_above_the_horizon_lies_in_its_own_bin(centre_directions, azimuth):
    above = geometry.merl_bins().above_horizon
    wi, wo = (rotated_about_normal(w[above], azimuth) for w in centre_directions)
    np.testing.assert_array_equal(geometry.merl_bin_index(wi, wo), np.nonzero(above))


def test_bin_index_of_random_directions_is_near_the_angles():
    wi, wo = random_pairs(5)
    theta_h, theta_d, phi_d = geometry.rusinkiewicz_from_directions(wi, wo)
    i, j, k = geometry.merl_bin_index(wi, wo)
    assert (geometry.theta_h_from_index(i) <= theta_h + 1e-12).all()
    assert (geometry.theta_h_from_index(i + 1) >= theta_h - 1e-12).all()
    assert np.abs(geometry.theta_d_centres()[j] - theta_d).max() <= np.radians(0.5) + 1e-12
    assert np.abs(geometry.phi_d_centres()[k] - phi_d).max() <= np.radians(0.5) + 1e-12


def test_bin_index_stays_inside_at_the_corners():
    n = np.array([0.0, 0.0, 1.0])
    x = np.array([1.0, 0.0, 0.0])
    assert geometry.merl_bin_index(n, n) == (0, 0, 0)
    assert geometry.merl_bin_index(x, x)[0] == 89
    assert geometry.merl_bin_index(x, -x)[1] == 89
    below = geometry.merl_bin_index(-n, -n)
    assert below[0] == 89


def test_solid_angle_sums_to_one():
    weight = geometry.merl_solid_angle()
    assert weight.shape == (90, 90)
    assert (weight > 0).all()
    assert weight.sum() == pytest.approx(1, abs=1e-12)
    # the measure's integrals: 1 - cos theta_h, and sin^2 theta_d
    edges = geometry.theta_h_from_index(np.arange(1, 91))
    np.testing.assert_allclose(np.cumsum(weight.sum(1)), 1 - np.cos(edges), rtol=0, atol=1e-12)
    edges = np.arange(1, 91) / 90 * np.pi / 2
    np.testing.assert_allclose(np.cumsum(weight.sum(0)), np.sin(edges) ** 2, rtol=0, atol=1e-4)


def test_normalized_keeps_zero():
    got = geometry.normalized(np.array([[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]]))
    np.testing.assert_allclose(got, [[0, 0, 0], [0, 0.6, 0.8]])


def test_polar_angle_is_precise_at_the_pole():
    angles = np.array([0, 1e-12, 0.5, np.pi / 2])
    vectors = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1)
    np.testing.assert_allclose(geometry.polar_angle(vectors), angles, rtol=1e-14)
