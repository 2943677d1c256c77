"""Lobes as sharp as the grid can hold, in single precision, wherever the surface lies."""

from functools import cache

import numpy as np
import pytest

from fitter.models.tables import lobe_albedo
from tests.models import make
from tests.render.samplings import SAMPLINGS
from tests.render.scenes import mean_and_noise, normals_at

# alpha 0.003 falls off within four bins of the square-root grid
MIRROR = make((0, 0, 0), (0.9, 0.7, 0.4), (0.003, 0.01, 0.03), [[0.5] * 3, [0.3] * 3, [0.2] * 3])
VIEWS = np.radians([3, 45, 75, 85])


@cache
def albedo():
    """Albedo (4, 3) at the views."""
    # many points: linear pieces of D meet inside the intervals of the quadrature
    return lobe_albedo(MIRROR, VIEWS, n_per_bin=32).sum(1)


def place(scene, size, shift):
    """Move and scale all that a scene shows, and the camera with it."""
    for item in scene.objects:
        item.location = size * np.array(item.location) + shift
        if item.type == "CAMERA":
            item.data.ortho_scale *= size
            item.data.clip_start, item.data.clip_end = 1e-3 * size, 1e3 * size
        else:
            item.scale = (size, size, size)


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
@pytest.mark.parametrize(
    ("size", "shift"),
    [(1, (0, 0, 0)), (1e-3, (0, 0, 0)), (1e3, (0, 0, 0)), (1, (1000, -500, 200))],
    ids=["plain", "tiny", "huge", "far away"],
)
def test_keep_their_energy(size, shift, sampling, stage, new_material, render):
    phi = np.random.default_rng(1).uniform(0, 2 * np.pi, (4, 64))
    normals = normals_at(VIEWS[:, None], phi).reshape(16, 16, 3)
    scene = stage.facets(new_material(MIRROR, sampling.name), normals, samples=64, light=1.0)
    place(scene, size, np.array(shift))
    mean, noise = mean_and_noise(render(scene).reshape(4, 1, 64, 3))
    expected = albedo()
    assert (noise < 5e-3 * expected).all()
    assert (np.abs(mean - expected) < (2e-3 + sampling.error) * expected + 4 * noise).all()
