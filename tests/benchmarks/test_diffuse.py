# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiment with the diffuse part of Ashikhmin and Shirley."""

import numpy as np
import pytest

from benchmarks import diffuse, planted
from fitter.fitting import weights
from fitter.fitting.appearance import AppearanceError
from fitter.fitting.problem import Problem

# nothing in Blender uses the experiments
pytestmark = pytest.mark.one_version


def test_falloff_is_that_of_ashikhmin_and_shirley():
    cosine = np.array([1.0, 0.5, 0.0])
    np.testing.assert_allclose(diffuse.falloff(cosine), [1, (1 - 0.75**5) / (1 - 0.5**5), 0])


@pytest.fixture
def named_weight(monkeypatch):
    monkeypatch.setitem(weights.WEIGHTS, diffuse.WEIGHT, diffuse.weight)


def test_a_model_of_this_kind_is_a_perfect_fit(make_measurement, named_weight):
    """Its table, divided, is what the experiment's problem makes of it; Lambert's is not."""
    model = planted.model()
    measurement = make_measurement(diffuse.ashikhmin_table(model))
    problem = diffuse.ashikhmin_problem(
        diffuse.divided(measurement), weight=diffuse.WEIGHT, n_angles=720
    )
    assert problem.objective_of(model) < 2e-5
    assert Problem(measurement, n_angles=720).objective_of(model) > 1e-3
    appearance = diffuse.ashikhmin_appearance(diffuse.divided(measurement), 1)
    assert appearance.value(model) < 1e-12
    assert AppearanceError.of(measurement, 1).value(model) > 1e-3


def test_weight_is_that_of_the_undivided_values():
    """Squared errors before and after the division count the same."""
    rng = np.random.default_rng(0)
    f_r, cos_i, cos_o = rng.uniform(0.05, 1, (3, 50))
    pair = diffuse.falloff(cos_i) * diffuse.falloff(cos_o)
    got = diffuse.weight(f_r / pair, cos_i, cos_o, 0.3)
    expected = weights.display_gamma(f_r, cos_i, cos_o, 0.3) * pair**2
    np.testing.assert_allclose(got, expected, rtol=1e-12)
