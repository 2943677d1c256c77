# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.pictures import sphere
from fitter.pictures.framed_scene import FramedScene, cloth_scene, cloth_slopes, sphere_scene


def texel_map(row, column):
    image = np.zeros((64, 128, 3))
    image[row, column] = (1, 2, 4)
    return image


@pytest.mark.parametrize("make", [sphere_scene, cloth_scene])
def test_white_furnace(make):
    scene = make([np.ones((64, 128, 3))], 16)
    albedo = np.array([1.0, 0.5, 0.18])
    pixels = scene.render(lambda wi, wo: np.broadcast_to(albedo / np.pi, wi.shape))
    np.testing.assert_allclose(pixels[0], np.tile(albedo, (len(pixels[0]), 1)), rtol=0.02)


def test_isotropic_materials_look_as_in_the_isotropic_scene(two_lobes):
    light = np.random.default_rng(0).random((64, 128, 3))
    framed = sphere_scene([light], 12)
    plain = sphere.SphereScene([light], 12)
    expected = plain.render(two_lobes.f_r)
    np.testing.assert_allclose(framed.render(two_lobes.lookup), expected, rtol=2e-3)


def test_one_texel_pixel_by_pixel():
    """Frame, cosine, light: every pixel by hand, with a BRDF that tells all three axes apart."""
    scene = sphere_scene([texel_map(20, 40)], 8)
    theta, phi = 20.5 / 64 * np.pi, 40.5 / 128 * 2 * np.pi
    light = np.array([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)])
    radiance = np.sin(theta) * (np.pi / 64) * (2 * np.pi / 128) * np.array([1, 2, 4])

    def f_r(wi, wo):
        return np.stack([2 + wi[:, 0] + wo[:, 1], 3 + wi[:, 1], 1 + wo[:, 0] * wi[:, 0]], -1)

    pixels = scene.render(f_r)[0]
    rows, columns = np.nonzero(scene.mask)
    lit = 0
    for pixel, (row, column) in enumerate(zip(rows, columns, strict=True)):
        x, y = (column + 0.5) / 4 - 1, 1 - (row + 0.5) / 4
        normal = np.array([x, y, np.sqrt(1 - x * x - y * y)])
        east = np.cross([0, 1, 0], normal)
        east /= np.linalg.norm(east)
        north = np.cross(normal, east)
        assert north[1] > 0  # the bitangent climbs towards the pole
        wi, wo = (np.array([[w @ east, w @ north, w @ normal]]) for w in (light, [0, 0, 1]))
        expected = f_r(wi, wo)[0] * max(wi[0, 2], 0) * radiance
        np.testing.assert_allclose(pixels[pixel], expected, rtol=1e-5, atol=1e-12)
        lit += wi[0, 2] > 0
    assert 10 < lit < len(rows)


def test_tangents_are_made_perpendicular():
    normals = np.array([[0.6, 0.0, 0.8]])
    scene = FramedScene(
        normals, np.array([[1.0, 0.0, 0.0]]), np.ones((1, 1), bool), [texel_map(0, 0)]
    )
    np.testing.assert_allclose(scene.frames[0] @ scene.frames[0].T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(scene.frames[0, 0], [0.8, 0, -0.6], atol=1e-12)
    assert np.linalg.det(scene.frames[0]) == pytest.approx(1)


def test_slopes_are_the_derivatives_of_the_height():
    def height(x, y):
        return (0.2 - 0.08 * y) * np.sin(9 * x + 1.5 * np.sin(2 * y) + 2 * x * y)

    x, y = np.random.default_rng(0).uniform(-1, 1, (2, 200))
    h = 1e-6
    slope_x, slope_y = cloth_slopes(x, y)
    np.testing.assert_allclose(slope_x, (height(x + h, y) - height(x - h, y)) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(slope_y, (height(x, y + h) - height(x, y - h)) / (2 * h), atol=1e-7)


def test_cloth_shows_all_view_angles_up_to_grazing():
    cos_o = cloth_scene([texel_map(0, 0)], 64).frames[:, 2, 2]
    assert np.degrees(np.arccos(cos_o.min())) == pytest.approx(65, abs=3)
    assert np.degrees(np.arccos(cos_o.max())) < 5
