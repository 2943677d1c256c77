# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.pictures import sphere
from fitter.pictures.sphere import SphereScene


@pytest.fixture(scope="module")
def scene():
    """White light, and one texel of light at row 20, column 40."""
    texel = np.zeros((64, 128, 3))
    texel[20, 40] = (1, 2, 4)
    return SphereScene([np.ones((64, 128, 3)), texel], resolution=32)


def test_white_furnace(scene):
    albedo = np.array([1.0, 0.5, 0.18])
    pixels = scene.render(np.full((90, 90, 180, 3), 1.0) * albedo / np.pi)
    assert pixels.shape == (2, scene.mask.sum(), 3)
    np.testing.assert_allclose(pixels[0], albedo * np.ones_like(pixels[0]), rtol=5e-3)


def test_mask_is_the_disc(scene):
    assert scene.mask.shape == (32, 32)
    assert scene.mask.sum() == pytest.approx(np.pi / 4 * 32**2, rel=0.02)
    np.testing.assert_array_equal(scene.mask, scene.mask[::-1, ::-1])


def test_look_up_is_that_of_the_measurement(scene, two_lobes):
    """One texel of light, frame by frame: f_r of the bin, times cosine, times light."""
    theta, phi = 20.5 / 64 * np.pi, 40.5 / 128 * 2 * np.pi
    light = np.array([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)])
    row, column = np.nonzero(scene.mask)
    x, y = (column + 0.5) / 16 - 1, 1 - (row + 0.5) / 16
    normal = np.stack([x, y, np.sqrt(1 - x * x - y * y)], -1)
    # any frame with the normal as z will do: the material is isotropic
    tangent = np.cross(normal, [0.3, 0.1, 0.9])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], 1)
    wi, wo = frame @ light, frame @ np.array([0.0, 0.0, 1.0])
    lit = wi[:, 2] > 0
    texel = np.sin(theta) * (np.pi / 64) * (2 * np.pi / 128) * np.array([1, 2, 4])
    expected = np.zeros((len(wi), 3))
    expected[lit] = two_lobes.lookup(wi[lit], wo[lit]) * wi[lit, 2:] * texel
    got = scene.render(two_lobes.f_r)[1]
    np.testing.assert_array_equal(got[~lit], 0)
    # rounding may choose the bin next door
    same = np.isclose(got, expected, rtol=1e-5).all(1)
    assert same[lit].mean() > 0.995
    assert lit.mean() > 0.3


def test_light_comes_from_the_side_it_is_on():
    above = np.zeros((64, 128, 3))
    above[:8] = 1
    scene = SphereScene([above], resolution=16)
    pixels = scene.render(np.full((90, 90, 180, 3), 1 / np.pi))
    picture = scene.picture(pixels[0], pixels[0])
    assert picture.shape == (16, 16, 3)
    assert picture[:4].sum() > 0
    np.testing.assert_array_equal(picture[-4:], 0)


def test_psnr_of_known_pictures():
    reference = np.full((1, 100, 3), 2.0)
    shown = 0.3 ** (1 / 2.2)
    np.testing.assert_array_equal(sphere.rendered_psnr(reference, reference), [120])
    # display values off by 0.1 everywhere: 20 dB
    off = reference * (shown - 0.1) ** 2.2 / 0.3
    np.testing.assert_allclose(sphere.rendered_psnr(off, reference), [20], rtol=1e-12)
    # and one channel of three
    mixed = reference.copy()
    mixed[..., 1] = off[..., 1]
    expected = [20 + 10 * np.log10(3)]
    np.testing.assert_allclose(sphere.rendered_psnr(mixed, reference), expected, rtol=1e-12)


def test_psnr_takes_each_environment_for_itself_and_clips_at_white():
    reference = np.stack([np.full((50, 3), 2.0), np.full((50, 3), 2e-3)])
    shown = 0.3 ** (1 / 2.2)
    factor = np.array([(shown - 0.1) ** 2.2 / 0.3, 1e9])[:, None, None]
    expected = [20, -20 * np.log10(1 - shown)]
    np.testing.assert_allclose(
        sphere.rendered_psnr(reference * factor, reference), expected, rtol=1e-12
    )


def test_box_filter():
    image = np.random.default_rng(0).random((9, 13, 3))
    got = sphere.box_filtered(image, 4, 3)
    assert got.shape == (4, 3, 3)
    np.testing.assert_allclose(got[2, 1], image[4:6, 4:8].mean((0, 1)), rtol=1e-13)


def test_texels_hold_their_middles():
    directions = sphere.texel_directions()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1)
    np.testing.assert_array_equal(sphere.texel_index(directions), np.arange(64 * 128))
