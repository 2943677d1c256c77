# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import albedo as anisotropic_albedo
from fitter.anisotropic.albedo import directional_albedo, lobe_albedo, within_energy
from tests.models import ANISOTROPIC_MODELS, random_anisotropic


@pytest.mark.parametrize("name", ANISOTROPIC_MODELS)
def test_albedo_is_the_integral_over_directions(name):
    """Against light directions drawn by the cosine, at four views."""
    model = ANISOTROPIC_MODELS[name]
    rng = np.random.default_rng(0)
    z, phi = np.sqrt(rng.random(200_000)), rng.uniform(0, 2 * np.pi, 200_000)
    sin = np.sqrt(1 - z * z)
    wi = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)
    views = polar_grid.unit_vectors(np.radians([0.0, 30.0, 60.0, 80.0]), np.array([0, 1, 3, 5.0]))
    got = directional_albedo(model, views)
    for view, albedo in zip(views, got, strict=True):
        expected = np.pi * model.f_r(wi, np.broadcast_to(view, wi.shape)).mean(0)
        np.testing.assert_allclose(albedo, expected, rtol=0.03)


def test_lobes_and_diffuse_add_up():
    model = ANISOTROPIC_MODELS["satin"]
    views = polar_grid.directions()[100:104]
    expected = np.pi * model.diffuse + lobe_albedo(model, views).sum(1)
    np.testing.assert_allclose(directional_albedo(model, views), expected)


def test_a_model_that_loses_light_is_left_alone():
    model = ANISOTROPIC_MODELS["brushed"]
    assert anisotropic_albedo.largest_directional_albedo(model) < 0.97
    assert within_energy(model) is model


@pytest.mark.parametrize("factor", [2, 20])
def test_a_model_that_makes_light_is_lowered(factor):
    model = ANISOTROPIC_MODELS["brushed"]
    bright = replace(model, scale=factor * model.scale)
    assert anisotropic_albedo.largest_directional_albedo(bright) > 1.2
    limited = within_energy(bright)
    assert anisotropic_albedo.largest_directional_albedo(limited) <= 1
    np.testing.assert_array_equal(limited.diffuse, model.diffuse)


def test_random_factors_are_brought_within_energy():
    model = random_anisotropic(0)
    assert anisotropic_albedo.largest_directional_albedo(within_energy(model)) <= 1


def test_light_made_beyond_the_last_nodes_alone_is_taken_back_there():
    """Pile reflects most at grazing angles: too much at 82.5 degrees and beyond, not at 75."""
    pile = ANISOTROPIC_MODELS["pile"]
    ndf = pile.ndf.copy()
    ndf[:, :5] *= 0.01
    model = replace(pile, ndf=ndf, fresnel=np.ones((3, 90)), scale=5 * pile.scale)
    assert directional_albedo(model, polar_grid.directions()).max() < 1
    assert anisotropic_albedo.largest_directional_albedo(model) > 1.2
    limited = within_energy(model)
    assert anisotropic_albedo.largest_directional_albedo(limited) <= 1
    # only the last row of G is lowered
    ratio = limited.masking / model.masking
    np.testing.assert_allclose(ratio[:, :5], np.broadcast_to(ratio[:, :1, :1], (3, 5, 48)))
    assert ratio[:, 5].min() < 0.9 * ratio[0, 0, 0]
