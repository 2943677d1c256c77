# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameterisation on files of our own; test_rgl.py has those against Mitsuba."""

from functools import partial

import numpy as np
import pytest

from fitter.formats import rgl, tensor_file
from fitter.geometry import HALF_PI
from tests import rgl_files

ALPHA = (0.2, 0.5)
CIRCLE = np.linspace(-np.pi, np.pi, 17)
HALF = np.linspace(-np.pi, 0, 9)
QUARTER = np.linspace(-np.pi, -HALF_PI, 5)


def brdf_of(f_r, *arguments, **options):
    fields = rgl_files.fields_of(f_r, *arguments, **options)
    return rgl.from_fields(tensor_file.parse(rgl_files.tensor_bytes(fields), "a.bsdf"), "a.bsdf")


def directions(rng, shape, smallest=0.1):
    z, phi = rng.uniform(smallest, 1, shape), rng.uniform(-np.pi, np.pi, shape)
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)


@pytest.fixture(scope="module")
def isotropic():
    return brdf_of(rgl_files.glossy)


@pytest.fixture(scope="module")
def pairs():
    return directions(np.random.default_rng(0), (2, 4000))


def rotated(vectors, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    return vectors @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])


@pytest.mark.parametrize("jacobian", [True, False])
def test_isotropic_file_holds_what_was_put_in(pairs, jacobian):
    found = brdf_of(rgl_files.glossy, jacobian=jacobian).f_r(*pairs)
    wanted = rgl_files.glossy(*pairs)
    np.testing.assert_allclose(found, found[:, :1] * [1, 0.5, 0.25], rtol=1e-6)
    # between the nodes the table is coarse
    assert np.median(np.abs(found[:, 0] / wanted - 1)) < 0.04
    assert found[:, 0].mean() == pytest.approx(wanted.mean(), rel=0.03)


@pytest.mark.parametrize("phi_i", [CIRCLE, HALF, QUARTER])
def test_anisotropic_file_holds_what_was_put_in(pairs, phi_i):
    """Half and quarter stand for the circle: the lobe has the symmetry of a rectangle."""
    brush = partial(rgl_files.glossy, alpha=ALPHA)
    found = brdf_of(brush, phi_i).f_r(*pairs)[:, 0]
    assert np.median(np.abs(found / brush(*pairs) - 1)) < 0.08
    # and not that of a circle: along the other axis it is another material
    across = brush(*(rotated(pair, HALF_PI) for pair in pairs))
    assert np.median(np.abs(found / across - 1)) > 0.3


def test_half_turn_of_a_table_over_half_the_circle(pairs):
    """A material without mirror planes, as a twill is: reduction 2 turns, it does not mirror."""

    def slanted(incident, exitant):
        turned = (rotated(direction, 0.5) for direction in (incident, exitant))
        return rgl_files.glossy(*turned, alpha=ALPHA)

    found = brdf_of(slanted, HALF).f_r(*pairs)[:, 0]
    assert np.median(np.abs(found / slanted(*pairs) - 1)) < 0.08


def test_exact_at_the_nodes(isotropic):
    """What lies between is a matter of resolution; at a node of everything nothing is lost."""
    theta_i = rgl_files.fields_of(rgl_files.glossy)["theta_i"][3]
    y, x = (axis.ravel() / 23 for axis in np.mgrid[0:24, 0:24])
    u, v = isotropic.vndf.sample(x, y, np.zeros(x.size), np.full(x.size, float(theta_i)))
    theta_m, phi_m = u**2 * HALF_PI, (2 * v - 1) * np.pi
    m = rgl_files.spherical(theta_m, phi_m)
    incident = np.broadcast_to(rgl_files.spherical(theta_i, 0.0), m.shape)
    exitant = 2 * (incident * m).sum(-1, keepdims=True) * m - incident
    above = exitant[:, 2] > 0.01
    assert above.sum() > 200
    found = isotropic.f_r(incident[above], exitant[above])[:, 0]
    np.testing.assert_allclose(found, rgl_files.glossy(incident[above], exitant[above]), rtol=2e-5)


def test_isotropic_does_not_change_in_a_turn(isotropic, pairs):
    turned = isotropic.f_r(*(rotated(pair, 1.234) for pair in pairs))
    np.testing.assert_allclose(turned, isotropic.f_r(*pairs), rtol=1e-6)


def test_the_two_directions_are_not_the_same(pairs):
    """The incident direction chooses the slice: what was put in need not be reciprocal."""

    def one_way(incident, exitant):
        return 1 + incident[:, 2] + 0 * exitant[:, 2]

    found = brdf_of(one_way).f_r(*pairs)[:, 0]
    assert np.median(np.abs(found / one_way(*pairs) - 1)) < 0.04
    assert np.median(np.abs(found / one_way(*pairs[::-1]) - 1)) > 0.12


def test_below_the_horizon(isotropic):
    up, down = np.array([[0.6, 0, 0.8]]), np.array([[0.6, 0, -0.8]])
    assert (isotropic.f_r(up, up) > 0).all()
    for pair in ((up, down), (down, up), (down, down)):
        assert (isotropic.f_r(*pair) == 0).all()


def test_normal_and_grazing_directions_give_numbers(isotropic):
    normal = np.array([[0.0, 0, 1]])
    grazing = np.array([[np.sqrt(1 - 1e-16), 0, 1e-8]])
    for pair in ((normal, normal), (normal, grazing), (grazing, normal), (grazing, grazing)):
        assert np.isfinite(isotropic.f_r(*pair)).all()


def test_mirrored_at_the_plane_of_incidence(isotropic, pairs):
    mirror = np.array([1, -1, 1])
    found = isotropic.f_r(*(pair * mirror for pair in pairs))
    np.testing.assert_allclose(found, isotropic.f_r(*pairs), rtol=0.02)


@pytest.mark.parametrize("phi_i", [(0.0,), CIRCLE, QUARTER])
def test_samples_follow_the_pdf(phi_i):
    """The share of the samples in each of 40 regions is the integral of the density over it."""
    brdf = brdf_of(rgl_files.glossy, phi_i, n=4)
    rng = np.random.default_rng(7)
    one = np.array([[0.3, 0.4, np.sqrt(0.75)]])
    n = 100_000
    drawn = brdf.sample(np.broadcast_to(one, (n, 3)), *rng.random((2, n)))
    np.testing.assert_allclose(np.linalg.norm(drawn, axis=1), 1, rtol=1e-9)

    z = (np.arange(400) + 0.5) / 400
    phi = ((np.arange(800) + 0.5) / 800 * 2 - 1) * np.pi
    z, phi = (axis.ravel() for axis in np.meshgrid(z, phi))
    sin = np.sqrt(1 - z * z)
    everywhere = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)
    density = brdf.pdf(np.broadcast_to(one, everywhere.shape), everywhere)
    expected = np.bincount(_region(everywhere), density * (2 * np.pi / z.size), 40)
    above = drawn[drawn[:, 2] > 0]
    found = np.bincount(_region(above), minlength=40) / n
    np.testing.assert_allclose(found, expected, atol=4 * np.sqrt(expected.max() / n) + 2e-3)
    assert expected.sum() > 0.5


def _region(directions):
    """Five zones of z and eight of azimuth."""
    zone = np.minimum((directions[:, 2] * 5).astype(int), 4)
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) + 0.5
    return zone * 8 + np.minimum((turn * 8).astype(int), 7)
