"""The shader inside Cycles computes the same numbers as the models."""

import numpy as np
import pytest

from tests.models import ANISOTROPIC_MODELS, MODELS

ALL_MODELS = MODELS | ANISOTROPIC_MODELS


def directions(rng, count):
    """Random pairs: a fifth grazing down to cos 1e-4, a fifth near the mirror direction."""

    def hemisphere(cosine):
        phi = rng.uniform(0, 2 * np.pi, cosine.size)
        sine = np.sqrt(1 - cosine**2)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], -1)

    fifth = count // 5
    wi, wo = hemisphere(rng.random(count)), hemisphere(rng.random(count))
    wi[:fifth] = hemisphere(10 ** rng.uniform(-4, -1, fifth))
    wo[fifth // 2 : fifth] = hemisphere(10 ** rng.uniform(-4, -1, fifth - fifth // 2))
    near = slice(fifth, 2 * fifth)
    wi[near] = wo[near] * [-1, -1, 1] + rng.normal(0, 0.02, (fifth, 3))
    wi[near, 2] = np.abs(wi[near, 2])
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    # what the shader sees
    return wi.astype(np.float32).astype(float), wo.astype(np.float32).astype(float)


@pytest.mark.parametrize("name", ALL_MODELS)
def test_equals_the_model(name, addon):
    wi, wo = directions(np.random.default_rng(1), 10_000)
    found = addon("evaluate").evaluate_through_osl(ALL_MODELS[name], wi, wo)
    expected = ALL_MODELS[name].f_r(wi, wo)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("name", ["metal", "pile"])
def test_is_reciprocal(name, addon):
    wi, wo = directions(np.random.default_rng(2), 4_000)
    evaluate = addon("evaluate").evaluate_through_osl
    there, back = evaluate(ALL_MODELS[name], wi, wo), evaluate(ALL_MODELS[name], wo, wi)
    np.testing.assert_allclose(there, back, rtol=1e-5)


def test_below_the_horizon_is_black(addon):
    up, down = np.array([[0.0, 0.6, 0.8]]), np.array([[0.0, 0.6, -0.8]])
    evaluate = addon("evaluate").evaluate_through_osl
    assert not evaluate(MODELS["matte"], up, down).any()
    assert not evaluate(MODELS["matte"], down, up).any()


def test_leaves_nothing_behind(blender, addon):
    kinds = ("scenes", "objects", "meshes", "cameras", "materials", "texts", "node_groups")
    unused = blender.data.meshes.new("the user's own, used by nothing")

    def names():
        return {kind: getattr(blender.data, kind).keys() for kind in kinds}

    before = names()
    wi, wo = directions(np.random.default_rng(3), 10)
    addon("evaluate").evaluate_through_osl(MODELS["matte"], wi, wo)
    assert names() == before
    assert unused.name in blender.data.meshes
