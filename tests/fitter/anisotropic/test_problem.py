# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic.problem import AnisotropicProblem
from fitter.fitting import weights
from fitter.grading import anisotropic_metrics
from fitter.taps import Taps
from tests.anisotropic_measurements import measurement_of
from tests.models import random_anisotropic


@pytest.fixture(scope="module")
def measurement():
    """Neither reciprocal nor one at the pole, and with holes."""
    rng = np.random.default_rng(0)
    valid = rng.random((6, 48, 6, 48)) > 0.1
    return measurement_of(rng.uniform(0, 2, (6, 48, 6, 48, 3)), valid)


@pytest.fixture(scope="module")
def problem(measurement):
    return AnisotropicProblem(measurement)


def pair_means(measurement):
    """Mean of the pairs that the model cannot tell apart, one pair at a time: (288, 288, 3)."""
    node = polar_grid.free_index()
    values = measurement.f_r.reshape(288, 288, 3)
    valid = measurement.valid.reshape(288, 288)
    areas = polar_grid.solid_angles()
    sums = {}
    for i, o in np.argwhere(valid):
        key = tuple(sorted((node[i], node[o])))
        total, measure = sums.get(key, (0, 0))
        area = areas[i] * areas[o]
        sums[key] = total + area * values[i, o], measure + area
    out = np.zeros((288, 288, 3))
    for i, o in np.argwhere(valid):
        total, measure = sums[tuple(sorted((node[i], node[o])))]
        out[i, o] = total / measure
    return out


def test_objective_is_the_sum_over_all_pairs(measurement, problem):
    """Eq. 2 over the 288 x 288 pairs of the file, without aggregation."""
    model = random_anisotropic(0)
    w = polar_grid.directions()
    mean = pair_means(measurement)
    areas = polar_grid.solid_angles() / (2 * np.pi)
    measure = np.outer(areas, areas) * measurement.valid.reshape(288, 288)
    cos_i, cos_o = np.broadcast_to(w[:, 2:], (288, 288)), np.broadcast_to(w[:, 2], (288, 288))
    cosines = measure * cos_i * cos_o
    level = (mean * cosines[..., None]).sum() / (3 * cosines.sum())
    f = anisotropic_metrics.tabulate(model).reshape(288, 288, 3)
    rho = measurement.f_r.reshape(288, 288, 3)
    error = energy = 0.0
    for c in range(3):
        weight = measure * weights.display_gamma(mean[..., c], cos_i, cos_o, level)
        error += (weight * (f[..., c] - rho[..., c]) ** 2).sum()
        energy += (weight * rho[..., c] ** 2).sum()
    assert problem.target_energy == pytest.approx(energy, rel=1e-9)
    assert problem.objective_of(model) == pytest.approx(error / energy, rel=1e-9)


def test_lobe_values_are_those_of_the_model(problem):
    model = random_anisotropic(1)
    w = polar_grid.directions()[47:]
    i, o = problem.nodes.index
    expected = np.moveaxis(model.lobe_values(w[i], w[o]), 2, 1)
    np.testing.assert_allclose(problem.lobe_values(model), expected, rtol=1e-9)


def test_zero_for_the_model_itself():
    model = random_anisotropic(2)
    problem = AnisotropicProblem(measurement_of(model))
    assert problem.objective_of(model) == pytest.approx(0, abs=1e-12)


def test_gathering_is_the_transpose(problem):
    rng = np.random.default_rng(1)
    values = rng.standard_normal(problem.theta_d.size)
    for taps in (problem.half, problem.difference, problem.nodes):
        table = rng.standard_normal(taps.size)
        at_samples = taps.of(table[None])[0]
        assert at_samples @ values == pytest.approx(table @ taps.gathered(values), rel=1e-9)


def test_product_sums(problem):
    """Against the dense matrices of some samples."""
    rng = np.random.default_rng(2)
    chosen = rng.permutation(problem.theta_d.size)[:200]
    values = np.zeros(problem.theta_d.size)
    values[chosen] = rng.standard_normal(200)

    def dense(taps: Taps):
        matrix = np.zeros((200, taps.size))
        for index, weight in zip(taps.index[:, chosen], taps.weight[:, chosen], strict=True):
            np.add.at(matrix, (np.arange(200), index), weight)
        return matrix

    for first, second in (
        (problem.half, problem.half),
        (problem.half, problem.difference),
        (problem.nodes, problem.half),
        (problem.one, problem.nodes),
    ):
        expected = (dense(first) * values[chosen, None]).T @ dense(second)
        got = problem.product_sums(first, second, values)
        np.testing.assert_allclose(got, expected, atol=1e-12)
