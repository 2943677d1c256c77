"""Under uniform white light a surface shows its directional albedo."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fitter.geometry import normalized
from fitter.models.tables import directional_albedo
from fitter.quadrature import view_quadrature
from tests.models import ANISOTROPIC_MODELS, MODELS
from tests.render.samplings import SAMPLINGS
from tests.render.scenes import mean_and_noise, normals_at

VIEWS = np.radians([0, 30, 55, 70, 80])
# where every approximation is worst
GRAZING_VIEWS = np.radians([84, 86, 88, 89.5])
ALL_VIEWS = np.append(VIEWS, GRAZING_VIEWS)


def show(stage, render, material, views, samples):
    """Mean and standard error (views, 3) of 128 facets per view angle under white light."""
    phi = np.random.default_rng(0).uniform(0, 2 * np.pi, (len(views), 128))
    normals = normals_at(views[:, None], phi).reshape(-1, 32, 3)
    pixels = render(stage.facets(material, normals, samples, light=1.0))
    return mean_and_noise(pixels.reshape(len(views), 1, 128, 3))


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
@pytest.mark.parametrize("name", MODELS)
def test_furnace_shows_the_albedo(name, sampling, stage, new_material, render):
    """At grazing angles, nothing may add light."""
    albedo = directional_albedo(MODELS[name], ALL_VIEWS)
    shown = show(stage, render, new_material(MODELS[name], sampling.name), ALL_VIEWS, 128)
    (mean, noise), expected = (x[: len(VIEWS)] for x in shown), albedo[: len(VIEWS)]
    assert (noise < 5e-3 * expected).all()
    assert (np.abs(mean - expected) < (1e-3 + sampling.error) * expected + 4 * noise).all()
    (mean, noise), expected = (x[len(VIEWS) :] for x in shown), albedo[len(VIEWS) :]
    assert (noise < 1.5e-2 * expected).all()
    assert (mean < (1 + sampling.error) * expected + 4 * noise).all()


@pytest.mark.parametrize("name", ["plastic", "velvet"])
def test_cosine_sampling_has_the_same_mean(name, stage, new_material, render):
    view = VIEWS[1:2]
    expected = directional_albedo(MODELS[name], view)
    mean, noise = show(stage, render, new_material(MODELS[name], "COSINE"), view, 4096)
    assert (noise < 5e-3 * expected).all()
    assert (np.abs(mean - expected) < 1e-3 * expected + 4 * noise).all()


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_lobe_scales_and_diffuse_multiply(sampling, stage, new_material, render):
    """Sockets change the picture as the model says, without a new shader."""
    model = MODELS["plastic"]
    factors = np.array([[0.5, 0.5, 0.5], [0.0, 0.0, 0.0], [3.0, 1.0, 0.2]])
    changed = replace(model, diffuse=np.array([0.3, 0.2, 0.1]), scale=model.scale * factors)
    material = new_material(model, sampling.name)
    group = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    group.inputs["Diffuse"].default_value = (*(np.pi * changed.diffuse), 1)
    for lobe, factor in enumerate(factors):
        group.inputs[f"Lobe {lobe + 1} Scale"].default_value = (*factor, 1)
    expected = directional_albedo(changed, VIEWS)
    mean, noise = show(stage, render, material, VIEWS, 128)
    assert (noise < 5e-3 * expected).all()
    assert (np.abs(mean - expected) < (1e-3 + sampling.error) * expected + 4 * noise).all()


# ---- materials with a direction ----

AZIMUTHS = np.radians([0, 50, 130, 245])


def directed_views(views):
    """Normals (n, 3) of facets seen from the view angles and azimuths, and their wo (n, 3).

    The tangent is +X of the world within the surface.
    """
    theta, phi = (a.ravel() for a in np.meshgrid(views, AZIMUTHS, indexing="ij"))
    normals = normals_at(theta, phi)
    tangents = normalized(np.array([1.0, 0, 0]) - normals[:, :1] * normals)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], 1)
    return normals, frames[..., 2]


def directed_albedo(model, wo):
    """Albedo (n, 3) at unit directions wo (n, 3)."""
    rows = []
    for direction in wo:
        theta, phi = np.arccos(direction[2]), np.arctan2(direction[1], direction[0])
        view = view_quadrature(theta, 90, 120, 2 * np.pi).turned(phi)
        f_r = model.f_r(view.wi, np.broadcast_to(view.wo, view.wi.shape))
        rows.append((view.solid_angle * view.wi[:, 2]) @ f_r)
    return np.array(rows)


def show_directed(stage, render, material, normals, samples):
    """Mean and standard error (n, 3) of 64 facets for each normal under white light."""
    group = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    group.inputs["Tangent"].default_value = (1, 0, 0)
    facets = np.repeat(normals[:, None], 64, 1)
    pixels = render(stage.facets(material, facets, samples, light=1.0))
    return mean_and_noise(pixels[:, None])


def directed_share(sampling):
    """By how much of the light a sampling may be wrong: views of the base lie further apart."""
    return 3 * sampling.error


@cache
def directed(name):
    """Normals (n, 3) of facets, and the albedo (n, 3) that they show."""
    normals, wo = directed_views(ALL_VIEWS[1:])
    return normals, directed_albedo(ANISOTROPIC_MODELS[name], wo)


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
@pytest.mark.parametrize("name", ANISOTROPIC_MODELS)
def test_furnace_of_a_material_with_a_direction(name, sampling, stage, new_material, render):
    """At grazing angles, nothing may add light."""
    normals, albedo = directed(name)
    material = new_material(ANISOTROPIC_MODELS[name], sampling.name)
    shown = show_directed(stage, render, material, normals, samples=128)
    steep = len(AZIMUTHS) * len(VIEWS[1:])
    (mean, noise), expected = (x[:steep] for x in shown), albedo[:steep]
    # the views do differ
    assert np.ptp(expected[8:12], axis=0).max() > 0.005 * expected.max()
    share = directed_share(sampling)
    assert (noise < 1e-2 * expected).all()
    assert (np.abs(mean - expected) < (2e-3 + share) * expected + 4 * noise).all()
    (mean, noise), expected = (x[steep:] for x in shown), albedo[steep:]
    assert (noise < 2e-2 * expected).all()
    assert (mean < (1 + share) * expected + 4 * noise).all()
