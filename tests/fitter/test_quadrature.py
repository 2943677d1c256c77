# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.quadrature import LEAST_COS_I, HalfVectors, view_quadrature
from fitter.shading.closures import Closure

DEGREES = [0, 0.5, 30, 60, 80, 86, 88]


@pytest.fixture(params=DEGREES)
def degrees(request):
    return request.param


@pytest.fixture
def view(degrees):
    """As many points as the base lobes are fitted with."""
    return view_quadrature(np.radians(degrees), 96, 16)


@pytest.fixture
def fine_view(degrees):
    return view_quadrature(np.radians(degrees), 300, 100)


def integral(view, values):
    return (values * view.solid_angle).sum()


def test_points(view, degrees):
    theta = np.radians(degrees)
    np.testing.assert_allclose(view.wo, [np.sin(theta), 0, np.cos(theta)], atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(view.wi, axis=1), 1, rtol=1e-12)
    assert view.wi.shape == (len(view.solid_angle), 3)
    assert (view.wi[:, 2] > LEAST_COS_I).all()
    assert (view.solid_angle > 0).all()
    # the other half is the mirror image
    assert (view.wi[:, 1] > 0).all()


def test_solid_angle_of_the_hemisphere(view, fine_view):
    assert integral(view, 1) == pytest.approx(2 * np.pi, rel=0.01)
    # at the horizon points come and go
    assert integral(fine_view, 1) == pytest.approx(2 * np.pi, rel=0.005)


def test_projected_solid_angle(view):
    assert integral(view, view.wi[:, 2]) == pytest.approx(np.pi, rel=5e-4)


def test_moments(fine_view):
    x, y, z = fine_view.wi.T
    for squared in (x * x, y * y, z * z):
        assert integral(fine_view, squared) == pytest.approx(2 * np.pi / 3, rel=0.01)
    for odd in (x, x * z):
        assert integral(fine_view, odd) == pytest.approx(0, abs=0.01)


def around_the_mirror_direction(theta_o):
    """Directions (n, 3) and solid angles of a midpoint rule, dense around the mirror of wo."""
    n_t, n_phi = 1500, 200
    t, phi = np.meshgrid((np.arange(n_t) + 0.5) / n_t, np.pi * (np.arange(n_phi) + 0.5) / n_phi)
    t, phi = t.ravel(), phi.ravel()
    # nearly all of pi t^3 (1 + t) / 2 is close to 0
    angle, width = np.pi * t**3 * (1 + t) / 2, np.pi * (3 * t**2 + 4 * t**3) / 2 / n_t
    x, y, z = np.sin(angle) * np.cos(phi), np.sin(angle) * np.sin(phi), np.cos(angle)
    sin_o, cos_o = np.sin(theta_o), np.cos(theta_o)
    wi = np.stack([x * cos_o - z * sin_o, y, z * cos_o + x * sin_o], -1)
    above = wi[:, 2] > 0
    return wi[above], (np.sin(angle) * width * 2 * np.pi / n_phi)[above]


@pytest.mark.parametrize(
    ("closure", "tolerance"),
    [
        (Closure("ggx", 0.002), 3e-3),
        (Closure("ggx", 0.03), 1e-3),
        (Closure("ggx", 0.4), 1e-3),
        (Closure("beckmann", 0.01), 1e-3),
        # does not fade out towards the horizon, which falls between the points
        (Closure("phong_ramp", 400), 0.05),
    ],
    ids=str,
)
def test_integrals_of_lobes(closure, tolerance, view, degrees):
    """The narrower a lobe, the denser the points: mirrors too, up to the horizon."""
    wi, solid_angle = around_the_mirror_direction(np.radians(degrees))
    expected = (closure.columns(wi, view.wo).sum(0) * solid_angle).sum()
    found = integral(view, closure.columns(view.wi, view.wo).sum(0))
    assert found == pytest.approx(expected, rel=tolerance)


def test_more_points_are_more_exact():
    theta = np.radians(50)
    errors = [
        abs(integral(view, view.wi[:, 2]) - np.pi)
        for view in (view_quadrature(theta, 12, 4), view_quadrature(theta, 96, 32))
    ]
    assert errors[1] < errors[0] / 10


# ---- half vectors ----


@pytest.fixture
def even_rings():
    """Rings of 1 degree."""
    edges = np.radians(np.arange(91))
    return HalfVectors.on_rings(
        (edges[1:] + edges[:-1]) / 2, -2 * np.pi * np.diff(np.cos(edges)), 40
    )


def test_half_vectors_cover_half_the_hemisphere_with_all_its_solid_angle(even_rings):
    h = even_rings.h
    assert h.shape == (90 * 40, 3)
    np.testing.assert_allclose(np.linalg.norm(h, axis=1), 1, rtol=1e-12)
    assert (h[:, 1:] > 0).all()
    assert even_rings.solid_angle.sum() == pytest.approx(2 * np.pi, rel=1e-12)
    for squared in (h**2).T:
        assert (squared * even_rings.solid_angle).sum() == pytest.approx(2 * np.pi / 3, rel=1e-3)


def test_light_directions_are_mirrored_about_half_vectors(even_rings, degrees):
    view = even_rings.at_view(np.radians(degrees))
    h = view.wi + view.wo
    h /= np.linalg.norm(h, axis=1)[:, None]
    found = np.abs(h[:, None, 2] - even_rings.h[None, :, 2]).min(1)
    assert found.max() < 1e-12
    assert (view.wi[:, 2] > 0).all()
    # the part of the hemisphere that lies between points at the horizon is not seen
    assert view.solid_angle.sum() == pytest.approx(2 * np.pi, rel=0.02)


def test_least_cosine(even_rings):
    low = even_rings.at_view(1.0, 0.3)
    assert low.wi[:, 2].min() > 0.3
    assert len(low.wi) == (even_rings.at_view(1.0).wi[:, 2] > 0.3).sum()


def test_turned_view(view):
    turned = view.turned(0.7)
    np.testing.assert_allclose(
        np.arctan2(turned.wo[1], turned.wo[0]) if view.wo[0] > 1e-9 else 0.7, 0.7, rtol=1e-12
    )
    np.testing.assert_allclose(turned.wi @ turned.wo, view.wi @ view.wo, atol=1e-12)
    np.testing.assert_array_equal(turned.wi[:, 2], view.wi[:, 2])
    assert (turned.solid_angle == view.solid_angle).all()


def test_whole_turn_has_both_sides(degrees):
    half, whole = (view_quadrature(np.radians(degrees), 40, n, n * np.pi / 24) for n in (24, 48))
    assert integral(whole, 1) == pytest.approx(integral(half, 1), rel=1e-9)
    assert integral(whole, whole.wi[:, 1]) == pytest.approx(0, abs=1e-9)
    assert len(whole.wi) == 2 * len(half.wi)
