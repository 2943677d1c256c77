# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiment with other masking terms."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import masking, planted
from fitter.fitting.problem import Problem
from fitter.grading.metrics import tabulate

# nothing in Blender uses the experiments
pytestmark = pytest.mark.one_version


@pytest.fixture(scope="module")
def model():
    return planted.model()


@pytest.fixture(scope="module")
def correlated(model):
    """A form whose Lambda is that of the model's G."""
    return masking.HeightCorrelated(model)


def test_correlated_form_is_that_of_smith(model, correlated):
    theta = (np.arange(masking.N_ANGLES) + 0.5) / masking.N_ANGLES * np.pi / 2
    masking_i = model.evaluate_masking(theta)
    lambda_ = 1 / masking_i - 1
    expected = 1 / (1 + lambda_[:, :, None] + lambda_[:, None, :])
    expected /= np.cos(theta)[:, None] * np.cos(theta)
    found = correlated.pairs()
    inside = slice(0, 160)  # beyond, G is too steep for nodes of Lambda every 2 degrees
    np.testing.assert_allclose(
        found[:, inside, inside], expected[:, inside, inside], rtol=0.01, atol=1e-4
    )


def test_product_is_the_model(make_measurement, model):
    problem = Problem(make_measurement(tabulate(model)), phi_group=5, n_angles=masking.N_ANGLES)
    table = masking.table_of(model, masking.Tables(problem, model).pairs())
    # angles are snapped to bins of half a degree
    assert np.abs(table - tabulate(model)).sum() < 0.02 * tabulate(model).sum()


@pytest.mark.parametrize("form", ["correlated", "tables"])
def test_rounds_find_the_form_again(make_measurement, model, correlated, form, monkeypatch):
    """Data of a correlated model; the start is the same model with the product."""
    monkeypatch.setattr(masking, "ROUNDS", 6)
    data = masking.table_of(model, correlated.pairs())
    problem = Problem(make_measurement(data), phi_group=5, n_angles=masking.N_ANGLES)
    start = replace(model, masking=np.sqrt(model.masking))
    form = masking.Tables(problem, start) if form == "tables" else masking.HeightCorrelated(start)
    before = problem.objective_of(start)
    _, after = masking.improved(problem, start, form)
    assert after < 0.1 * before
