# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import updates
from fitter.anisotropic.problem import AnisotropicProblem
from tests.anisotropic_measurements import measurement_of
from tests.models import ANISOTROPIC_MODELS, random_anisotropic


@pytest.fixture(scope="module")
def problem():
    return AnisotropicProblem(measurement_of(ANISOTROPIC_MODELS["brushed"]))


UPDATES = {
    "diffuse and scale": updates.update_diffuse_and_scale,
    "ndf": updates.update_ndf,
    "fresnel": updates.update_fresnel,
    "masking": lambda problem, model: updates.update_masking(problem, model, 1),
}


@pytest.mark.parametrize("name", UPDATES)
@pytest.mark.parametrize("seed", range(3))
def test_no_update_raises_the_objective(problem, name, seed):
    model = random_anisotropic(seed)
    before = problem.objective_of(model)
    after = problem.objective_of(UPDATES[name](problem, model))
    assert after < before


@pytest.mark.parametrize("name", UPDATES)
def test_an_update_touches_its_own_factor_alone(problem, name):
    model = random_anisotropic(3)
    after = UPDATES[name](problem, model)
    own = {"diffuse and scale": {"diffuse", "scale"}}.get(name, {name})
    for factor in ("diffuse", "scale", "ndf", "masking", "fresnel"):
        same = np.array_equal(getattr(after, factor), getattr(model, factor))
        assert same == (factor not in own)


def test_diffuse_and_scale_are_recovered(problem):
    truth = ANISOTROPIC_MODELS["brushed"]
    wrong = replace(truth, diffuse=np.ones(3), scale=np.full((3, 3), 0.7))
    found = updates.update_diffuse_and_scale(problem, wrong)
    np.testing.assert_allclose(found.scale, truth.scale, rtol=1e-5)
    np.testing.assert_allclose(found.diffuse, truth.diffuse, rtol=1e-5)


def test_masking_of_one_lobe_alone(problem):
    truth = ANISOTROPIC_MODELS["brushed"]
    masking = truth.masking.copy()
    masking[1] = 0.5
    model = replace(truth, masking=masking)
    for _ in range(30):
        model = updates.update_masking(problem, model, 1)
    np.testing.assert_array_equal(model.masking[[0, 2]], truth.masking[[0, 2]])
    np.testing.assert_allclose(model.masking[1], truth.masking[1], rtol=0.02)


def test_masking_steps_are_exact(problem):
    """No other value of a node is better, where the update has just put it: the last one."""
    model = updates.update_masking(problem, ANISOTROPIC_MODELS["satin"], 0)
    best = problem.objective_of(model)
    for factor in (0.97, 0.999, 1.001, 1.03):
        masking = model.masking.copy()
        masking[0, 5, 47] *= factor
        assert problem.objective_of(replace(model, masking=masking)) > best


@pytest.mark.parametrize("start", range(2))
def test_sweeps_never_raise_the_objective(problem, start):
    model = random_anisotropic(start)
    objective = problem.objective_of(model)
    for i in range(6):
        model = updates.sweep(problem, model, hold_lobes=i == 0)
        after = problem.objective_of(model)
        assert after <= objective * (1 + 1e-12)
        objective = after
    assert objective < 0.05


def test_the_first_sweep_holds_the_lobes(problem):
    model = random_anisotropic(5).normalized()
    swept = updates.sweep(problem, model, hold_lobes=True)
    np.testing.assert_allclose(swept.ndf, model.ndf, rtol=1e-12)


def test_poles_stay_tied_and_nothing_reaches_zero(problem):
    model = random_anisotropic(6)
    for i in range(3):
        model = updates.sweep(problem, model, hold_lobes=i == 0)
    for table in (model.ndf, model.masking):
        np.testing.assert_array_equal(table[:, 0], np.repeat(table[:, 0, :1], 48, axis=1))
        assert table.min() > 0
    assert model.fresnel.min() > 0


def test_what_the_data_does_not_see_is_held(problem):
    """No pair of nodes has theta_d beyond 75 degrees."""
    model = random_anisotropic(7)
    unseen = np.s_[:, 76:]
    found = updates.update_fresnel(problem, model)
    np.testing.assert_array_equal(found.fresnel[unseen], model.fresnel[unseen])


def test_holes_in_the_data(problem):
    valid = np.ones((6, 48, 6, 48), bool)
    valid[:, :, 4, 11] = valid[4, 11] = False  # a direction that no pair has
    with_hole = AnisotropicProblem(measurement_of(ANISOTROPIC_MODELS["brushed"], valid))
    model = random_anisotropic(8)
    found = updates.update_masking(with_hole, model, 2)
    assert found.masking[2, 4, 11] == model.masking[2, 4, 11]
    changed = polar_grid.free_numbers(found.masking != model.masking)[2]
    assert changed.sum() == polar_grid.N_FREE - 1
