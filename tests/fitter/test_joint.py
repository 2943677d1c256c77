# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from fitter import joint
from fitter.problem import Problem, amplitudes

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
    layout = joint._Layout.of(model)
    x = layout.pack(model)
    assert layout.size == len(x) == 822
    seen = sparse.weight > 0
    jacobian = np.empty((822, seen.sum()))
    h = 1e-5
    for k in range(822):
        step = np.zeros(822)
        step[k] = h
        up, down = (layout.unpack(x + s) for s in (step, -step))
        jacobian[k] = (values_of(sparse, up, seen) - values_of(sparse, down, seen)) / (2 * h)
    objective, normal, gradient = joint._normal_equations(sparse, model, layout)

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
        up, down = (sparse.objective_of(layout.unpack(x + s)) for s in (step, -step))
        slope = (up - down) / 2e-4
        expected_slope = -2 * gradient[k] / sparse.target_energy
        assert slope == pytest.approx(expected_slope, rel=1e-4, abs=1e-10)


def test_pack_and_unpack(random_model):
    model = random_model(1)
    layout = joint._Layout.of(model)
    again = layout.unpack(layout.pack(model))
    for name in FACTORS:
        np.testing.assert_allclose(getattr(again, name), getattr(model, name), rtol=1e-13)


def test_diffuse_stops_at_zero(random_model):
    model = random_model(1)
    layout = joint._Layout.of(model)
    x = layout.pack(model)
    x[layout.diffuse] = (-0.1, 0, 0.2)
    np.testing.assert_array_equal(layout.unpack(x).diffuse, [0, 0, 0.2])


def test_exactly_nine_null_directions(coarse, random_model):
    model = random_model(2).normalized()
    _, normal, gradient = joint._normal_equations(coarse, model, joint._Layout.of(model))
    scale = 1 / np.sqrt(np.diag(normal))
    eigenvalues, vectors = np.linalg.eigh(normal * scale * scale[:, None])
    eigenvalues /= eigenvalues[-1]
    assert np.count_nonzero(eigenvalues < 1e-10) == 9
    assert np.abs(eigenvalues[:9]).max() < 1e-14 * 822
    # along them the objective does not change at all
    assert np.abs(vectors[:, :9].T @ (gradient * scale)).max() < 1e-9 * np.linalg.norm(
        gradient * scale
    )


@pytest.mark.parametrize("seed", range(3))
def test_every_step_lowers_the_objective(coarse, random_model, seed):
    first = random_model(seed)
    start = objective = coarse.objective_of(first)
    n = 0
    for model, value in islice(joint.refine(coarse, first), 6):
        assert value < objective
        assert coarse.objective_of(model) == pytest.approx(value, rel=1e-9)
        objective = value
        n += 1
        for name in ("ndf", "masking", "fresnel"):
            np.testing.assert_allclose(getattr(model, name).max(1), 1, rtol=1e-14)
    assert n == 6
    assert objective < start / 2


def test_zeros_stay_zero_and_nothing_turns_nan(coarse, random_model):
    rng = np.random.default_rng(3)
    start = random_model(3)
    zeroed = {
        name: np.where(rng.random(getattr(start, name).shape) < 0.1, 0, getattr(start, name))
        for name in ("ndf", "masking", "fresnel")
    }
    scale = start.scale.copy()
    scale[1, 2] = 0
    start = replace(start, **zeroed, scale=scale, diffuse=np.array([0, 0.1, 0]))
    steps = list(islice(joint.refine(coarse, start), 5))
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


def test_dead_lobe_stays_dead(coarse, random_model):
    start = random_model(4)
    ndf = start.ndf.copy()
    ndf[1] = 0
    steps = list(islice(joint.refine(coarse, replace(start, ndf=ndf)), 3))
    assert len(steps) == 3
    for model, _ in steps:
        np.testing.assert_array_equal(model.ndf[1], 0)
        assert all(np.isfinite(getattr(model, name)).all() for name in FACTORS)


def test_level_factors_are_preferred_in_the_step_only(coarse, random_model, monkeypatch):
    """The penalty is the sum of (log F[j + 1] - log F[j])^2; numbers that are zero have none."""
    monkeypatch.setattr(joint, "DRIFT_LEVEL", 0)  # the same for D and G: see the next test
    start = random_model(6)
    fresnel = start.fresnel.copy()
    fresnel[1, 40] = 0
    model = replace(start, fresnel=fresnel)
    layout = joint._Layout.of(model)
    normal, gradient = np.zeros((822, 822)), np.zeros(822)
    joint._prefer_level_factors(coarse, model, layout, normal, gradient)
    weight = joint.FRESNEL_LEVEL * coarse.target_energy

    def penalty(log_f):
        return weight * sum(np.nansum(np.diff(row) ** 2) for row in log_f)

    with np.errstate(divide="ignore"):
        log_f = np.log(fresnel)
    log_f[1, 40] = np.nan
    rows = np.arange(822)[layout.fresnel].reshape(3, 90)
    for c, j in ((0, 0), (0, 1), (1, 39), (1, 40), (1, 41), (2, 89)):
        up, down = log_f.copy(), log_f.copy()
        up[c, j] += 1e-3
        down[c, j] -= 1e-3
        values = penalty(up), penalty(log_f), penalty(down)
        slope = (values[0] - values[2]) / 2e-3
        curvature = (values[0] - 2 * values[1] + values[2]) / 1e-6
        # the convention of the normal equations: half of the derivatives
        k = rows[c, j]
        assert gradient[k] == pytest.approx(-slope / 2, rel=1e-6, abs=1e-12)
        assert normal[k, k] == pytest.approx(curvature / 2, rel=1e-4, abs=1e-12)
    np.testing.assert_array_equal(normal, normal.T)
    np.testing.assert_allclose(normal.sum(1), 0, atol=1e-12 * normal.max())
    others = np.delete(np.arange(822), rows.ravel())
    assert not normal[others].any()
    assert not gradient[others].any()


def test_drift_of_d_and_g_is_damped(coarse, random_model):
    """Each row of D, G and F gets the chain matrix of its differences, of its own strength."""
    model = random_model(6)
    layout = joint._Layout.of(model)
    normal, gradient = np.zeros((822, 822)), np.zeros(822)
    joint._prefer_level_factors(coarse, model, layout, normal, gradient)
    difference = np.diff(np.eye(90), axis=0)
    for factor, position, level in (
        (model.ndf, layout.ndf, joint.DRIFT_LEVEL),
        (model.masking, layout.masking, joint.DRIFT_LEVEL),
        (model.fresnel, layout.fresnel, joint.FRESNEL_LEVEL),
    ):
        chain = level * coarse.target_energy * difference.T @ difference
        np.testing.assert_allclose(normal[position, position], np.kron(np.eye(3), chain))
        expected = -chain @ np.log(factor).T
        np.testing.assert_allclose(gradient[position], expected.T.ravel(), atol=1e-12)


def test_start_is_not_modified(coarse, random_model):
    model = random_model(5)
    before = {name: getattr(model, name).copy() for name in FACTORS}
    next(joint.refine(coarse, model))
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(model, name), before[name])
