# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import albedo as anisotropic_albedo
from fitter.models import quick_albedo, tables
from tests.models import ANISOTROPIC_MODELS, MODELS

ANGLES = np.radians([0, 20, 45, 70, 80, 87, 89.5])


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_isotropic_albedo_is_that_of_a_fine_integral(model):
    found = quick_albedo.lobe_albedo(model, quick_albedo.views_at(ANGLES))
    expected = tables.lobe_albedo(model, ANGLES, n_phi=96, n_per_bin=8)
    np.testing.assert_allclose(found.sum(1), expected.sum(1), rtol=0.002)
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=1e-9)


@pytest.mark.parametrize("model", ANISOTROPIC_MODELS.values(), ids=ANISOTROPIC_MODELS)
def test_anisotropic_albedo_is_that_of_a_fine_integral(model, monkeypatch):
    views = tuple((theta, phi) for theta in ANGLES.tolist() for phi in (0.0, 1.0, 2.2, 4.0))
    found = quick_albedo.lobe_albedo(model, views)
    monkeypatch.setattr(anisotropic_albedo, "N_THETA_H", 90)
    monkeypatch.setattr(anisotropic_albedo, "N_PHI_H", 192)
    wo = polar_grid.unit_vectors(*np.array(views).T)
    expected = anisotropic_albedo.lobe_albedo(model, wo)
    np.testing.assert_allclose(found.sum(1), expected.sum(1), rtol=0.01)
    np.testing.assert_allclose(found, expected, rtol=0.015, atol=1e-9)


def test_a_lobe_without_light_has_no_albedo():
    model = MODELS["metal"]
    dark = type(model)(model.diffuse, model.scale, model.ndf * 0, model.masking, model.fresnel)
    assert not quick_albedo.lobe_albedo(dark, quick_albedo.views_at(ANGLES)).any()
