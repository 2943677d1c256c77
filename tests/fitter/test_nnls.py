# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from fitter.nnls import solve_nonnegative


def random_problems(size, rows, seed=0, n=200):
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((n, rows, size))
    matrix = factor.transpose(0, 2, 1) @ factor
    right = (factor.transpose(0, 2, 1) @ rng.standard_normal((n, rows, 1)))[..., 0]
    return matrix, right


def objective(matrix, right, x):
    return np.einsum("ni,nij,nj->n", x, matrix, x) - 2 * (right * x).sum(-1)


def assert_optimal(matrix, right, x, tolerance):
    """The conditions of Karush, Kuhn and Tucker, in units in which the diagonal is 1."""
    assert np.isfinite(x).all()
    assert (x >= 0).all()
    scale = np.sqrt(np.einsum("nii->ni", matrix))
    safe = np.where(scale > 0, scale, 1)
    gradient = (np.einsum("nij,nj->ni", matrix, x) - right) / safe
    size = np.abs(right / safe).max(-1, keepdims=True) + 1e-300
    assert (gradient / size).min() > -tolerance  # nothing to gain by raising a number
    assert np.abs(x * scale * gradient / size**2).max() < tolerance  # nor by lowering one


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_regular_problems(size):
    matrix, right = random_problems(size, rows=6)
    x = solve_nonnegative(matrix, right)
    assert_optimal(matrix, right, x, 1e-9)
    # some unknowns are bound and some are free, or this tests nothing
    assert 0.1 < np.mean(x > 0) < 0.9


@pytest.mark.parametrize("size", [2, 3, 4])
def test_brute_force(size):
    matrix, right = random_problems(size, rows=6, seed=1, n=50)
    best = np.zeros(len(right))
    for free in itertools.product([False, True], repeat=size):
        chosen = np.flatnonzero(free)
        for n in range(len(right)):
            x = np.zeros(size)
            x[chosen] = np.linalg.lstsq(
                matrix[n][np.ix_(chosen, chosen)], right[n, chosen], rcond=None
            )[0]
            if (x >= 0).all():
                best[n] = min(best[n], x @ matrix[n] @ x - 2 * right[n] @ x)
    got = objective(matrix, right, solve_nonnegative(matrix, right))
    np.testing.assert_allclose(got, best, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("ratio", [1e8, 1e-8])
def test_badly_scaled_problems(ratio):
    matrix, right = random_problems(4, rows=6, seed=2)
    scale = ratio ** np.array([0, 0.3, 0.6, 1])
    x = solve_nonnegative(matrix * scale * scale[:, None], right * scale)
    assert_optimal(matrix * scale * scale[:, None], right * scale, x, 1e-9)
    np.testing.assert_allclose(x * scale, solve_nonnegative(matrix, right), rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_singular_problems(rows):
    matrix, right = random_problems(4, rows=rows, seed=3)
    x = solve_nonnegative(matrix, right)
    assert_optimal(matrix, right, x, 1e-4)


def test_two_equal_columns_share():
    matrix = np.ones((1, 2, 2))
    x = solve_nonnegative(matrix, np.full((1, 2), 3.0))
    assert x.sum() == pytest.approx(3)
    assert (x >= 0).all()


def test_zero_rows():
    matrix, right = random_problems(4, rows=6, seed=4)
    matrix[:, 2] = matrix[:, :, 2] = 0
    right[:, 2] = 0
    x = solve_nonnegative(matrix, right)
    np.testing.assert_array_equal(x[:, 2], 0)
    others = [0, 1, 3]
    expected = solve_nonnegative(matrix[:, others][:, :, others], right[:, others])
    np.testing.assert_allclose(x[:, others], expected, rtol=1e-12)


def test_nothing_but_zeros():
    np.testing.assert_array_equal(solve_nonnegative(np.zeros((3, 4, 4)), np.zeros((3, 4))), 0)


def test_inputs_are_not_modified():
    matrix, right = random_problems(3, rows=6)
    before = matrix.copy(), right.copy()
    solve_nonnegative(matrix, right)
    np.testing.assert_array_equal(matrix, before[0])
    np.testing.assert_array_equal(right, before[1])
