# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.anisotropic.albedo import lobe_albedo
from fitter.models.anisotropic_tables import (
    SELECTION_GRID,
    anisotropic_sampling,
    anisotropic_selection,
    density_angles,
)
from fitter.polar_grid import PHI_STEP, phi_nodes, unit_vectors
from tests.models import ANISOTROPIC_MODELS


@pytest.fixture(params=ANISOTROPIC_MODELS)
def model(request):
    return ANISOTROPIC_MODELS[request.param]


def test_density_is_d_times_cosine_at_the_nodes(model):
    tables = anisotropic_sampling(model)
    theta, phi = np.meshgrid(density_angles(), phi_nodes(), indexing="ij")
    expected = model.evaluate_ndf(theta.ravel(), phi.ravel()) * np.cos(theta.ravel())
    expected = expected.reshape(tables.row_density.shape)
    factor = tables.row_density[:, 12, 5] / expected[:, 12, 5]
    np.testing.assert_allclose(tables.row_density, factor[:, None, None] * expected, atol=1e-12)


def test_density_integrates_to_one(model):
    tables = anisotropic_sampling(model)
    over_phi = tables.row_density.sum(2) * PHI_STEP
    total = ((over_phi[:, 1:] + over_phi[:, :-1]) / 2 * np.diff(tables.nodes)).sum(1)
    np.testing.assert_allclose(total, 1, rtol=1e-12)


def test_cumulative_tables_are_integrals_of_the_densities(model):
    tables = anisotropic_sampling(model)
    assert (tables.cumulative[:, 0] == 0).all()
    np.testing.assert_allclose(tables.cumulative[:, -1], 1, rtol=1e-12)
    mass = np.pi * (tables.density[:, 1:] + tables.density[:, :-1]) * np.diff(tables.nodes)
    np.testing.assert_allclose(np.diff(tables.cumulative), mass, atol=1e-12)
    between = (tables.row_density + np.roll(tables.row_density, -1, axis=2)) / 2 * PHI_STEP
    np.testing.assert_allclose(np.diff(tables.row_cumulative), between, atol=1e-12)
    np.testing.assert_allclose(
        tables.row_cumulative[:, :, -1], 2 * np.pi * tables.density, atol=1e-12
    )


def test_lobe_without_normals_is_drawn_by_the_cosine():
    model = ANISOTROPIC_MODELS["satin"]
    tables = anisotropic_sampling(replace(model, ndf=model.ndf * [[[1]], [[0]], [[1]]]))
    cosine = np.maximum(np.cos(density_angles()), 0) / np.pi
    np.testing.assert_allclose(tables.density[1], cosine, rtol=0.01, atol=1e-12)


def test_selection_is_the_albedo(model):
    table = anisotropic_selection(model)
    assert table.shape == (model.n_lobes, *SELECTION_GRID, 3)
    views = unit_vectors(np.radians([0, 42, 42, 72]), np.radians([0, 0, 105, 300]))
    found = table[:, [0, 7, 7, 12], [0, 0, 7, 20]]
    np.testing.assert_allclose(np.moveaxis(found, 0, 1), lobe_albedo(model, views), rtol=0.03)
