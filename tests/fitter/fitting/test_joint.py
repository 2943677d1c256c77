# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fitter.fitting import fit, joint, prior
from fitter.fitting.problem import Problem, amplitudes

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


@pytest.fixture(scope="module")
def sparse(two_lobes, make_measurement):
    """Few enough samples to write down the whole Jacobian."""
    cells = np.random.default_rng(0).random((90, 90)) < 0.12
    valid = two_lobes.valid & cells[:, :, None]
    return Problem(make_measurement(two_lobes.f_r, valid), phi_group=45, n_angles=60)


def values_of(problem, model, seen):
    a = amplitudes(model).reshape(-1, 3, 3)
    f = model.diffuse + np.einsum("xmc,mxp->xpc", a, problem.kernels(model.masking))
    return f[seen]


def test_normal_equations_against_finite_differences(sparse, random_model):
    model = random_model(0)
    layout = joint.Layout.of(model)
    x = layout.pack(model)
    assert layout.size == len(x) == 822
    seen = sparse.weight > 0
    jacobian = np.empty((822, seen.sum()))
    h = 1e-5
    for k in range(822):
        step = np.zeros(822)
        step[k] = h
        up, down = (layout.unpack(x + s, model) for s in (step, -step))
        jacobian[k] = (values_of(sparse, up, seen) - values_of(sparse, down, seen)) / (2 * h)
    objective, normal, gradient = joint.normal_equations(sparse, model, layout)

    w = sparse.weight[seen]
    expected = (jacobian * w) @ jacobian.T
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # every one of the 822 x 822 numbers, in units of its row and column
    assert np.abs(normal - expected).max() > 0  # two different computations
    assert (np.abs(normal - expected) <= 1e-8 * size + 1e-30).all()
    np.testing.assert_array_equal(normal, normal.T)

    residual = sparse.weighted_target[seen] - w * values_of(sparse, model, seen)
    right = jacobian @ residual
    np.testing.assert_allclose(gradient, right, rtol=1e-6, atol=1e-8 * np.abs(right).max())

    assert objective == pytest.approx(sparse.objective_of(model), rel=1e-12)
    for k in range(0, 822, 41):
        step = np.zeros(822)
        step[k] = 1e-4
        up, down = (sparse.objective_of(layout.unpack(x + s, model)) for s in (step, -step))
        slope = (up - down) / 2e-4
        expected_slope = -2 * gradient[k] / sparse.target_energy
        assert slope == pytest.approx(expected_slope, rel=1e-4, abs=1e-7)


def test_pack_and_unpack(random_model):
    model = random_model(1)
    layout = joint.Layout.of(model)
    again = layout.unpack(layout.pack(model), model)
    for name in FACTORS:
        np.testing.assert_allclose(getattr(again, name), getattr(model, name), rtol=1e-13)


def test_diffuse_stops_at_zero(random_model):
    model = random_model(1)
    layout = joint.Layout.of(model)
    x = layout.pack(model)
    x[layout.diffuse] = (-0.1, 0, 0.2)
    np.testing.assert_array_equal(layout.unpack(x, model).diffuse, [0, 0, 0.2])


def test_exactly_nine_null_directions(coarse, random_model):
    model = random_model(2).normalized()
    _, normal, gradient = joint.normal_equations(coarse, model, joint.Layout.of(model))
    scale = 1 / np.sqrt(np.diag(normal))
    eigenvalues, vectors = np.linalg.eigh(normal * scale * scale[:, None])
    eigenvalues /= eigenvalues[-1]
    assert np.count_nonzero(eigenvalues < 1e-10) == 9
    assert np.abs(eigenvalues[:9]).max() < 1e-14 * 822
    # along them the objective does not change at all
    assert np.abs(vectors[:, :9].T @ (gradient * scale)).max() < 1e-9 * np.linalg.norm(
        gradient * scale
    )


@pytest.mark.parametrize("strength", [0, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_every_step_lowers_the_objective(tiny, random_model, seed, strength):
    first = random_model(seed)
    start = objective = joint.objective_of(tiny, first, strength)
    n = 0
    for model, value in islice(joint.refine(tiny, first, strength), 6):
        assert value < objective
        assert joint.objective_of(tiny, model, strength) == pytest.approx(value, rel=1e-9)
        objective = value
        n += 1
        for name in ("ndf", "masking", "fresnel"):
            np.testing.assert_allclose(getattr(model, name).max(1), 1, rtol=1e-14)
    assert n == 6
    assert objective < start / 2


def test_zeros_stay_zero_and_nothing_turns_nan(tiny, random_model):
    rng = np.random.default_rng(3)
    start = random_model(3)
    zeroed = {
        name: np.where(rng.random(getattr(start, name).shape) < 0.1, 0, getattr(start, name))
        for name in ("ndf", "masking", "fresnel")
    }
    scale = start.scale.copy()
    scale[1, 2] = 0
    start = replace(start, **zeroed, scale=scale, diffuse=np.array([0, 0.1, 0]))
    steps = list(islice(joint.refine(tiny, start), 5))
    assert len(steps) == 5
    for model, value in steps:
        assert np.isfinite(value)
        for name in FACTORS:
            array = getattr(model, name)
            assert np.isfinite(array).all()
            assert (array >= 0).all()
            if name != "diffuse":
                np.testing.assert_array_equal(array == 0, getattr(start, name) == 0)
    # d moves linearly, so that it can leave zero
    assert (steps[-1][0].diffuse > 0).any()


def test_dead_lobe_stays_dead(tiny, random_model):
    start = random_model(4)
    ndf = start.ndf.copy()
    ndf[1] = 0
    steps = list(islice(joint.refine(tiny, replace(start, ndf=ndf)), 3))
    assert len(steps) == 3
    for model, _ in steps:
        np.testing.assert_array_equal(model.ndf[1], 0)
        assert all(np.isfinite(getattr(model, name)).all() for name in FACTORS)


@pytest.mark.parametrize("strength", [0, 0.5])
def test_prior_enters_the_normal_equations(coarse, random_model, strength):
    """Half the derivative of E e^disorder, over e^disorder; the matrix is J' J of the terms."""
    model = random_model(6).normalized()
    layout = joint.Layout.of(model)
    objective, data_normal, data_gradient = joint.normal_equations(coarse, model, layout)
    normal, gradient = data_normal.copy(), data_gradient.copy()
    joint._add_prior(coarse, model, strength, objective, layout, normal, gradient)
    added, slope = normal - data_normal, gradient - data_gradient
    np.testing.assert_allclose(added, added.T, atol=1e-9 * np.abs(added).max())
    np.testing.assert_array_equal(added[layout.scale], 0)
    np.testing.assert_array_equal(added[layout.diffuse], 0)
    jacobian = np.zeros((0, 822))
    expected = np.zeros(822)
    for name, terms in prior.terms(model, strength).items():
        rows = np.zeros((len(terms.value), 822))
        position = getattr(layout, name).start + terms.index
        np.add.at(rows, (np.arange(len(rows))[:, None], position), terms.slope)
        jacobian = np.concatenate([jacobian, rows])
        expected -= rows.T @ terms.value
    unit = objective * coarse.target_energy
    np.testing.assert_allclose(added, unit * jacobian.T @ jacobian, atol=1e-9 * np.abs(added).max())
    np.testing.assert_allclose(slope, unit * expected, atol=1e-9 * np.abs(slope).max())


def test_prior_puts_factors_in_order(tiny, random_model):
    """With it, steps from the same start end with less disorder."""
    start = fit.sweep(tiny, random_model(7), hold_lobes=True)
    free, ordered = (
        list(islice(joint.refine(tiny, start, strength), 12))[-1][0] for strength in (0, 1)
    )
    assert prior.disorder(ordered, 1) < prior.disorder(free, 1) / 3


def test_objective_includes_the_disorder(coarse, random_model):
    model = random_model(8)
    expected = coarse.objective_of(model) * np.exp(prior.disorder(model, 0.3))
    assert joint.objective_of(coarse, model, 0.3) == pytest.approx(expected)
    assert expected > 1.1 * coarse.objective_of(model)


def test_start_is_not_modified(tiny, random_model):
    model = random_model(5)
    before = {name: getattr(model, name).copy() for name in FACTORS}
    next(joint.refine(tiny, model))
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(model, name), before[name])
