# SPDX-License-Identifier: GPL-3.0-or-later
import itertools
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fitter.pictures.sphere import rendered_psnr
from fitter.quadrature import view_quadrature
from fitter.shading.base_error import N_RINGS, base_error, sphere_points, studio
from fitter.shading.base_lobes import BaseLobes, fit_base_lobes
from fitter.shading.closures import Closure
from fitter.shading.view_grid import FIT_GRIDS
from tests.models import ANISOTROPIC_MODELS, MODELS

VIEW_ANGLES = np.array(FIT_GRIDS["isotropic"].theta_o)
GLOSSY = (Closure("ggx", 0.2), Closure("phong_ramp", 3.0))


@dataclass(frozen=True)
class Same:
    """Stands in for a model whose lobes are the base itself."""

    base: BaseLobes
    diffuse: np.ndarray
    kind: str = "isotropic"

    def lobe_values(self, wi, wo):
        return (self.base.value(wi, wo[0]) / wi[:, 2:])[None]


@pytest.fixture(scope="module")
def base():
    return fit_base_lobes(MODELS["paint"], GLOSSY)


@pytest.fixture(scope="module")
def model(base):
    return Same(base, np.zeros(3))


def scaled(base, factor):
    """factor broadcasts over (rows, azimuths, lobes, channels, columns)."""
    return replace(base, weights=base.weights * factor)


def uniform(directions):
    return np.ones(directions.shape)


# ---- how much ----


def test_no_error(model, base):
    error = base_error(model, base)
    assert error.directional < 1e-15
    assert error.image < 1e-15
    assert error.psnr == pytest.approx(120)  # as much as the PSNR of sphere.py counts


@pytest.mark.parametrize("factor", [1.1, 0.9, 0.5, 2.0])
@pytest.mark.parametrize("light", [studio, uniform])
def test_a_base_that_is_too_bright_or_too_dark(factor, light, model, base):
    error = base_error(model, scaled(base, factor), light)
    assert error.directional == pytest.approx(abs(factor - 1), rel=1e-9)
    assert error.image == pytest.approx(abs(factor - 1), rel=1e-9)


def test_error_grows(model, base):
    errors = [base_error(model, scaled(base, factor)) for factor in (1.001, 1.01, 1.05, 1.2)]
    for first, second in itertools.pairwise(errors):
        assert first.directional < second.directional
        assert first.image < second.image
        assert first.psnr > second.psnr


def test_diffuse_light_is_counted_in_both(model, base):
    """The shader adds the diffuse part to either; it dilutes the error."""
    plain = base_error(model, scaled(base, 1.1), uniform)
    diluted = base_error(
        replace(model, diffuse=np.full(3, 0.5 / np.pi)), scaled(base, 1.1), uniform
    )
    assert 0.01 < diluted.image < 0.6 * plain.image
    assert 0.01 < diluted.directional < 0.6 * plain.directional


def test_errors_of_all_channels_count(model, base):
    one = np.ones((1, 1, 3, 1))
    one[..., 2, :] = 1.3
    all_ = base_error(model, scaled(base, 1.3), uniform)
    assert 0.05 < base_error(model, scaled(base, one), uniform).image < 0.9 * all_.image


def test_differences_do_not_cancel_over_directions():
    """Too much here and too little there: a picture may hide it, the directions do not."""
    weights = np.full((len(VIEW_ANGLES), 1, 1, 3, 4), 0.5)
    closures = (Closure("ggx", 0.1), Closure("ggx", 0.4))
    base = BaseLobes(closures, VIEW_ANGLES, weights, np.zeros((len(VIEW_ANGLES), 1, 1, 2)))
    error = base_error(Same(base, np.zeros(3)), scaled(base, [1.2, 1.2, 0.8, 0.8]), uniform)
    assert 0.05 < error.directional < 0.2
    assert error.image < 0.2 * error.directional


def test_black_model():
    black = replace(MODELS["matte"], scale=np.zeros((3, 3)), diffuse=np.zeros(3))
    error = base_error(black, fit_base_lobes(black, GLOSSY))
    assert (error.directional, error.image, error.psnr) == (0, 0, np.inf)
    assert error.figures()["native_psnr"] == 200  # what JSON and Blender's properties can hold


def test_figures(model, base):
    error = base_error(model, scaled(base, 1.1))
    assert error.figures() == {
        "native_error": error.image,
        "native_directional_error": error.directional,
        "native_psnr": error.psnr,
    }


@pytest.mark.parametrize("name", MODELS)
def test_fitted_bases(bases, name):
    """The targets of native sampling, on these models."""
    error = base_error(MODELS[name], bases[name])
    assert 0 < error.image < (0.004 if name == "metal" else 0.001)
    assert error.image < error.directional < 0.02
    assert error.psnr > 55


# ---- the picture ----


def test_picture_under_uniform_light_shows_albedos(base):
    """Rings of equal area: the sum over the picture is that of the rings' albedos."""
    model = MODELS["velvet"]
    wrong = differences = total = 0
    pixels = np.empty((2, N_RINGS, 3))
    for ring in range(N_RINGS):
        view = view_quadrature(np.arcsin(np.sqrt((ring + 0.5) / N_RINGS)), 96, 16)
        exact = model.f_r(view.wi, np.broadcast_to(view.wo, view.wi.shape)) * view.wi[:, 2:]
        found = base.value(view.wi, view.wo) + model.diffuse * view.wi[:, 2:]
        pixels[:, ring] = view.solid_angle @ found, view.solid_angle @ exact
        differences += (view.solid_angle @ np.abs(found - exact)).sum()
        total += pixels[1, ring].sum()
        wrong += np.abs(pixels[0, ring] - pixels[1, ring]).sum()
    error = base_error(model, base, uniform)
    assert error.image == pytest.approx(wrong / total, rel=1e-9)
    assert error.directional == pytest.approx(differences / total, rel=1e-9)
    assert error.psnr == pytest.approx(rendered_psnr(pixels[:1], pixels[1:])[0], rel=1e-9)


def test_directional_error_knows_no_light(base):
    errors = [base_error(MODELS["velvet"], base, light) for light in (studio, uniform)]
    assert errors[0].directional == errors[1].directional
    assert errors[0].image != errors[1].image


def test_light_from_behind_shows_at_the_edge_only(model, base):
    """+z is towards the viewer: what the middle of the sphere shows is not lit from -z."""

    def behind(directions):
        return np.repeat(directions[..., 2:] < -np.sin(np.radians(40)), 3, -1).astype(float)

    def before(directions):
        return behind(-directions)

    middle = np.where(base.theta_o < np.radians(30), 0.5, 1)[:, None, None, None, None]
    edge = np.where(base.theta_o > np.radians(60), 0.5, 1)[:, None, None, None, None]
    assert base_error(model, scaled(base, middle), behind).image < 1e-15
    assert base_error(model, scaled(base, edge), behind).image > 0.2
    assert base_error(model, scaled(base, middle), before).image > 0.02


def test_light_is_asked_for_in_all_directions(base):
    seen = []

    def light(directions):
        seen.append(directions)
        return studio(directions)

    base_error(MODELS["plastic"], base, light)
    directions = np.concatenate(seen)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-9)
    # every direction of space lights some point of the visible half
    rng = np.random.default_rng(0)
    for wanted in rng.normal(size=(20, 3)):
        assert (directions @ (wanted / np.linalg.norm(wanted))).max() > 0.99
    # and none is preferred to its mirror image
    mean = directions.mean(0)
    np.testing.assert_allclose(mean[:2], 0, atol=1e-3)
    assert mean[2] > 0.02


def turned(light, degrees, mirrored=1):
    """The light turned around the line of sight, or mirrored."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * [mirrored, 1, 1]

    def turn(directions):
        return light(directions @ matrix)

    return turn


def test_picture_turns_with_the_light(base):
    """The points of the rings lie alike after an eighth of a turn, and in a mirror."""
    model = MODELS["plastic"]
    expected = base_error(model, base)
    for other in (turned(studio, 45), turned(studio, 180), turned(studio, 90, -1)):
        found = base_error(model, base, other)
        assert found.image == pytest.approx(expected.image, rel=1e-9)
        assert found.psnr == pytest.approx(expected.psnr, rel=1e-9)


def test_the_studio():
    """A sky, dark below, a soft box and a small bright lamp."""
    directions = np.random.default_rng(1).normal(size=(40_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    radiance = studio(directions)
    assert radiance.shape == (40_000, 3)
    assert (radiance > 0).all()
    down = directions[:, 1] < 0
    assert radiance[down].mean() < 0.5 * radiance[~down].mean()
    up, level, level_too, below = studio(
        np.array([[0, 1.0, 0], [0, 0.01, -1], [1, 0.01, 0], [0, -1, 0]])
    )
    assert (up > 2 * level).all()
    assert (level == level_too).all()
    assert (below < 0.6 * level).all()
    brightness = radiance.mean(1)
    assert brightness.max() > 50
    assert 0.0005 < (brightness > 20).mean() < 0.003  # a lamp with a radius of 4 degrees
    assert 0.02 < ((brightness > 3) & (brightness < 20)).mean() < 0.06
    # grids of directions too
    assert (studio(directions.reshape(200, 200, 3)) == radiance.reshape(200, 200, 3)).all()


# ---- materials with a direction ----


def test_tangents_are_increasing_longitude():
    for point in sphere_points(4, 6):
        (frame,) = point.frames
        tangent, bitangent, normal = frame
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.cross(tangent, bitangent) @ normal == pytest.approx(1)
        # about the upward axis, y: level, and counter-clockwise seen from above
        assert tangent[1] == pytest.approx(0, abs=1e-12)
        assert np.cross([0, 1, 0], normal) @ tangent > 0
        # the quadrature's viewer is the sphere's
        np.testing.assert_allclose(frame @ [0, 0, 1.0], point.view.wo, atol=1e-12)


@pytest.fixture(scope="module")
def directed():
    model = ANISOTROPIC_MODELS["brushed"]
    closures = (Closure("ggx", 0.2, across=0.4), Closure("phong_ramp", 8.0))
    return fit_base_lobes(model, closures, draft=True)


@pytest.mark.parametrize("factor", [1.1, 0.7])
def test_error_of_a_directed_base_that_is_too_bright_or_too_dark(factor, directed):
    error = base_error(Same(directed, np.zeros(3), "anisotropic"), scaled(directed, factor))
    assert error.directional == pytest.approx(abs(factor - 1), rel=1e-9)
    assert error.image == pytest.approx(abs(factor - 1), rel=1e-9)


def test_wrong_direction_shows_in_the_picture(directed):
    """A base whose tangents are off by a quarter turn is seen."""
    lobe, ramp = directed.closures
    turned = replace(directed, closures=(replace(lobe, azimuth=np.pi / 2), ramp))
    model = Same(directed, np.zeros(3), "anisotropic")
    assert base_error(model, directed).image < 1e-12
    assert base_error(model, turned).image > 0.05
