# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from compare import scenes
from compare.scenes import SceneSource, reduced
from tests.compare.test_mesh import globe


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(scenes, "SPHERE_HEIGHT", 24)
    monkeypatch.setattr(scenes, "MESH_HEIGHT", 25)  # a margin of half a pixel on each side


def test_globe_is_lit_as_the_sphere(small, two_lobes):
    environment = np.random.default_rng(0).uniform(0, 3, (64, 128, 3))
    environment[10:20, 30:40] = 50
    sphere = SceneSource("sphere", environment).build()
    mesh = SceneSource("globe", environment, globe()).build()
    means = [scene.render(two_lobes.f_r)[0].mean(0) for scene in (sphere, mesh)]
    np.testing.assert_allclose(means[0], means[1], rtol=0.05)


def test_fingerprint_is_that_of_the_pictures(small, monkeypatch):
    environment = np.ones((64, 128, 3))
    brighter = environment.copy()
    brighter[3, 4] = 2
    vertices, faces = globe(4)
    sources = [
        SceneSource("a", environment),
        SceneSource("a", brighter),
        SceneSource("a", environment, (vertices, faces)),
        SceneSource("a", environment, (vertices * 1.5, faces)),
    ]
    prints = {source.fingerprint for source in sources}
    assert len(prints) == 4
    assert SceneSource("another name", environment).fingerprint in prints
    monkeypatch.setattr(scenes, "SPHERE_HEIGHT", 32)
    assert sources[0].fingerprint not in prints


def test_maps_are_reduced_or_enlarged():
    image = np.random.default_rng(0).random((128, 256, 3))
    got = reduced(image)
    assert got.shape == (64, 128, 3)
    np.testing.assert_allclose(got[5, 7], image[10:12, 14:16].mean((0, 1)), rtol=1e-12)
    small = image[:32, :64]
    np.testing.assert_allclose(reduced(small)[1::2, 1::2], small, rtol=1e-12)
    assert reduced(image[:10, :256]).shape == (64, 128, 3)
