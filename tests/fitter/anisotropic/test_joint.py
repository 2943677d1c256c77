# SPDX-License-Identifier: GPL-3.0-or-later
from itertools import islice

import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic.joint import normal_equations
from fitter.anisotropic.problem import AnisotropicProblem
from fitter.fitting import joint
from tests.anisotropic_measurements import measurement_of
from tests.models import ANISOTROPIC_MODELS, random_anisotropic


@pytest.fixture(scope="module")
def problem():
    return AnisotropicProblem(measurement_of(ANISOTROPIC_MODELS["brushed"]))


def test_pack_and_unpack():
    model = random_anisotropic(0)
    layout = joint.Layout.of(model)
    assert layout.size == 3 * 241 + 270 + 3 * 241 + 9 + 3
    again = layout.unpack(layout.pack(model), model)
    for name in ("diffuse", "scale", "ndf", "masking", "fresnel"):
        np.testing.assert_allclose(getattr(again, name), getattr(model, name), rtol=1e-13)


def values_of(problem, model):
    return model.diffuse[:, None] + problem.lobe_values(model).sum(0)


def test_normal_equations_against_finite_differences(problem):
    model = ANISOTROPIC_MODELS["pile"]
    layout = joint.Layout.of(model)
    x = layout.pack(model)
    objective, normal, gradient = normal_equations(problem, model, layout)
    assert objective == pytest.approx(problem.objective_of(model), rel=1e-12)

    # some numbers of every factor, poles and ends among them
    chosen = [
        part.start + k
        for part in (layout.ndf, layout.fresnel, layout.masking, layout.scale, layout.diffuse)
        for k in {0, 1, (part.stop - part.start) // 2, part.stop - part.start - 1}
    ]
    chosen += [layout.ndf.start + 241 + 130, layout.masking.start + 482 + 77]
    jacobian = []
    for k in chosen:
        step = np.zeros(layout.size)
        step[k] = 1e-5
        up, down = (values_of(problem, layout.unpack(x + s, model)) for s in (step, -step))
        jacobian.append((up - down) / 2e-5)
    jacobian = np.stack(jacobian)
    expected = np.einsum("acn,bcn,cn->ab", jacobian, jacobian, problem.weight)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    got = normal[np.ix_(chosen, chosen)]
    assert (np.abs(got - expected) <= 1e-7 * size + 1e-30).all()
    assert (np.abs(normal - normal.T) <= 1e-12 * np.abs(normal)).all()
    residual = problem.weighted_target - problem.weight * values_of(problem, model)
    right = np.einsum("acn,cn->a", jacobian, residual)
    np.testing.assert_allclose(gradient[chosen], right, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("strength", [0, 0.3])
def test_every_step_lowers_the_objective(problem, strength):
    model = ANISOTROPIC_MODELS["satin"]
    objective = joint.objective_of(problem, model, strength)
    steps = joint.refine(problem, model, strength, equations=normal_equations)
    for stepped, after in islice(steps, 8):
        assert after < objective
        assert after == pytest.approx(joint.objective_of(problem, stepped, strength), rel=1e-9)
        objective = after
    assert objective < 0.1


def test_steps_keep_the_gauge_and_the_poles(problem):
    steps = joint.refine(problem, ANISOTROPIC_MODELS["satin"], 0.3, equations=normal_equations)
    model = next(steps)[0]
    for table in (model.ndf, model.masking):
        np.testing.assert_array_equal(table[:, 0], np.repeat(table[:, 0, :1], 48, axis=1))
        np.testing.assert_allclose(polar_grid.free_numbers(table).max(1), 1)
