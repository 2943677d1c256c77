"""A sun without size makes Cycles evaluate the material at single pairs of directions."""

import numpy as np
import pytest

from tests.models import MODELS
from tests.render.samplings import SAMPLINGS

# of the reflected light, summed over the facets
LARGEST_ERROR = 0.01

LIT = [sampling for sampling in SAMPLINGS if sampling.sees_points]

# the sun's direction; the viewer is at +Z
SUN = np.array([np.sin(1.0), 0.0, np.cos(1.0)])


@pytest.fixture
def show(stage, new_material, render):
    """f cos(theta_i) (n, 3) that facets of some normals (n, 3) show under the sun."""

    def run(name, sampling, normals):
        material = new_material(MODELS[name], sampling.name)
        scene = stage.facets(material, normals.reshape(-1, 32, 3), samples=32)
        stage.sun(scene, SUN)
        return render(scene).reshape(-1, 3)

    return run


def facing_normals(rng, count):
    """Normals that both the viewer and the sun are above, half of them near the half vector."""
    half = SUN + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    near = half + 0.1 * rng.normal(size=(count, 3))
    anywhere = half + rng.normal(size=(4 * count, 3))
    normals = np.concatenate([near[: count // 2], anywhere])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals[(normals[:, 2] > 0.1) & (normals @ SUN > 0.1)][:count]


def model_values(name, normals):
    """f cos(theta_i) (n, 3) of the model; only angles count, so each frame may turn freely."""
    cos_o, cos_i = normals[:, 2], normals @ SUN
    sin_o, sin_i = np.sqrt(1 - cos_o**2), np.sqrt(1 - cos_i**2)
    cos_phi = np.clip((SUN[2] - cos_i * cos_o) / (sin_i * sin_o), -1, 1)
    wo = np.stack([sin_o, 0 * sin_o, cos_o], -1)
    wi = np.stack([sin_i * cos_phi, sin_i * np.sqrt(1 - cos_phi**2), cos_i], -1)
    return MODELS[name].f_r(wi, wo) * cos_i[:, None]


@pytest.mark.parametrize("sampling", LIT, ids=str)
@pytest.mark.parametrize("name", MODELS)
def test_shows_the_model(name, sampling, show):
    normals = facing_normals(np.random.default_rng(0), 512)
    found, expected = show(name, sampling, normals), model_values(name, normals)
    share = np.abs(found - expected).sum() / expected.sum()
    assert share < LARGEST_ERROR
    assert abs(found.sum() / expected.sum() - 1) < LARGEST_ERROR


@pytest.mark.parametrize("sampling", LIT, ids=str)
@pytest.mark.parametrize("name", MODELS)
def test_is_reciprocal(name, sampling, show):
    """A normal mirrored between viewer and sun exchanges the two."""
    normals = facing_normals(np.random.default_rng(1), 512)
    between = SUN - np.array([0, 0, 1])
    between /= np.linalg.norm(between)
    mirrored = normals - 2 * (normals @ between)[:, None] * between
    both = np.concatenate([normals, mirrored])
    there, back = np.split(show(name, sampling, both) / (both @ SUN)[:, None], 2)
    assert np.abs(there - back).sum() / there.sum() < LARGEST_ERROR
