# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks import measured_sphere
from fitter.formats import rgl, tensor_file
from fitter.pictures.sphere import LitScene
from tests import rgl_files

NORMALS = np.array([[0, 0, 1], [0.6, 0, 0.8], [0, -0.8, 0.6], [0.28, 0.936, 0.2132]])


@pytest.fixture(scope="module")
def file():
    fields = rgl_files.fields_of(rgl_files.glossy, n=8, n_theta=5, width=0.03)
    return rgl.from_fields(tensor_file.parse(rgl_files.tensor_bytes(fields), "a.bsdf"), "a.bsdf")


def scene_of(*environments):
    return LitScene(NORMALS, np.ones((2, 2), bool), list(environments))


@pytest.fixture(scope="module")
def white():
    return scene_of(np.ones((64, 128, 3)))


def matte(wi, wo):
    return np.full((len(wi), 3), 1 / np.pi)


def sharp(width):
    """A mirror of this width in radians, of albedo about 1 at every view angle."""

    def f_r(wi, wo):
        h = wi + wo
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        tan2 = (h[:, :1] ** 2 + h[:, 1:2] ** 2) / h[:, 2:] ** 2
        ndf = np.exp(-tan2 / width**2) / (np.pi * width**2 * h[:, 2:] ** 4)
        return np.repeat(ndf / (4 * wi[:, 2:] * wo[:, 2:]), 3, axis=1)

    return f_r


def test_matte_material_under_white_light_is_white(file, white):
    (pixels,) = measured_sphere.render(white, file, [matte])
    np.testing.assert_allclose(pixels, 1, atol=0.01)


def test_lobe_narrower_than_a_texel_keeps_its_energy(file, white):
    """A texel is 2.8 degrees; looked up at the texels' middles alone, 0.6 degrees is a lottery."""
    (pixels,) = measured_sphere.render(white, file, [sharp(0.01)], grid=256)
    np.testing.assert_allclose(pixels[:, :2], 1, atol=0.1)


def test_pixels_see_the_texel_in_the_mirror_direction(file):
    """A narrow lobe shows the map, the right way round, for a normal in any place."""
    rng = np.random.default_rng(0)
    dark, spot = (np.full((64, 128, 3), value) for value in (0.0, 0.0))
    normal = NORMALS[1]
    mirror = 2 * normal[2] * normal - [0, 0, 1]
    row = int(np.arccos(mirror[1]) / np.pi * 64)
    column = int(np.mod(np.arctan2(mirror[2], mirror[0]), 2 * np.pi) / (2 * np.pi) * 128)
    spot[row - 2 : row + 3, column - 2 : column + 3] = rng.uniform(0.9, 1.1, 3)
    (pixels,) = measured_sphere.render(scene_of(dark, spot), file, [sharp(0.02)], grid=128)
    assert (pixels[0] == 0).all()
    assert (pixels[1, 1] > 0.7).all()
    assert pixels[1, 0].max() < 0.05


def test_all_brdfs_of_a_call_share_their_directions(file, white):
    one, two = measured_sphere.render(white, file, [matte, lambda wi, wo: 2 * matte(wi, wo)])
    np.testing.assert_allclose(two, 2 * one)
