# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.models.tables import directional_albedo
from fitter.shading.stand_in import VIEW_ANGLES, matched_alpha, stand_in, without_direction
from tests.models import ANISOTROPIC_MODELS, MODELS, make


@pytest.mark.parametrize("alphas", [(0.01, 0.1, 0.5), (0.02, 0.25, 0.8)])
def test_alpha_of_ggx_lobes_is_found(alphas):
    model = make((0, 0, 0), (0.5,) * 3, alphas, np.full((3, 3), 0.3))
    np.testing.assert_allclose(matched_alpha(model), alphas, rtol=0.05)


@pytest.mark.parametrize("name", MODELS)
def test_energy_is_that_of_the_model_at_every_view_angle(name):
    model = MODELS[name]
    found = stand_in(model)
    expected = directional_albedo(model, np.radians(VIEW_ANGLES))
    np.testing.assert_allclose(found.diffuse + found.albedo.sum(0), expected, rtol=0.03)


def test_a_white_ggx_lobe_gets_the_colour_of_its_fresnel():
    """At normal incidence the colour undoes the masking, and what remains is F0."""
    model = make((0, 0, 0), (0.9, 0.6, 0.3), (0.05, 0.1, 0.2), np.full((3, 3), 1.0))
    np.testing.assert_allclose(stand_in(model).colors[:, 0], [[0.9, 0.6, 0.3]] * 3, rtol=0.08)


@pytest.mark.parametrize("name", ANISOTROPIC_MODELS)
def test_anisotropic_models_are_averaged(name):
    """Seen from above the mean over azimuths reflects what the model does."""
    model = ANISOTROPIC_MODELS[name]
    mean = without_direction(model)
    assert mean.ndf.shape == mean.masking.shape == (3, 90)
    phi = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    for theta_h in (0.1, 0.5):
        expected = model.evaluate_ndf(np.full(720, theta_h), phi).mean(-1)
        found = mean.evaluate_ndf(np.array([theta_h]))[:, 0]
        np.testing.assert_allclose(found, expected, rtol=0.05, atol=1e-3)
    assert (stand_in(model).albedo <= 1.2).all()
