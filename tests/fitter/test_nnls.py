# SPDX-License-Identifier: GPL-3.0-or-later
import itertools

import numpy as np
import pytest

from fitter import nnls
from fitter.nnls import PartlyNonnegative, descend, solve_nonnegative, solve_partly_nonnegative


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


# ---- one problem, some unknowns free ----


def brute_force(matrix, right, nonnegative):
    """The best of all active sets."""
    best, best_value = None, np.inf
    for bound in itertools.product([False, True], repeat=int(nonnegative.sum())):
        chosen = ~nonnegative
        chosen[nonnegative] = ~np.array(bound, bool)
        x = np.zeros(len(right))
        x[chosen] = np.linalg.solve(matrix[np.ix_(chosen, chosen)], right[chosen])
        value = x @ matrix @ x - 2 * right @ x
        if (x[nonnegative] >= 0).all() and value < best_value:
            best, best_value = x, value
    return best


MASKS = {
    "all free": [False] * 7,
    "none free": [True] * 7,
    "one free": [True] * 6 + [False],
    "one bound": [False] * 3 + [True] + [False] * 3,
    "mixed": [True, False, True, True, False, True, False],
}


@pytest.mark.parametrize("mask", MASKS.values(), ids=MASKS)
def test_partly_brute_force(mask):
    mask = np.array(mask)
    problems = list(zip(*random_problems(7, rows=9, seed=5, n=60), strict=True))
    got = np.array([solve_partly_nonnegative(*problem, mask) for problem in problems])
    expected = np.array([brute_force(*problem, mask) for problem in problems])
    np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-9)
    assert (got[:, mask] >= 0).all()
    if mask.any():
        # some are bound and some are not, or this tests nothing
        assert 0.1 < np.mean(got[:, mask] > 0) < 0.9
    if not mask.all():
        assert (got[:, ~mask] < 0).any()


def test_partly_all_free_is_a_linear_system():
    matrix, right = (part[0] for part in random_problems(20, rows=30, seed=6, n=1))
    x = solve_partly_nonnegative(matrix, right, np.zeros(20, bool))
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-12)


def test_partly_none_free_equals_the_other_solver():
    matrix, right = random_problems(4, rows=6, seed=7, n=50)
    none_free = np.ones(4, bool)
    got = [
        solve_partly_nonnegative(*problem, none_free) for problem in zip(matrix, right, strict=True)
    ]
    np.testing.assert_allclose(got, solve_nonnegative(matrix, right), rtol=1e-7, atol=1e-9)


def lean_columns(rng, ridge):
    """Normal equations of 40 columns, neighbours nearly alike, as lobes of similar widths are."""
    widths = np.geomspace(0.02, 0.9, 40)
    x = np.linspace(0, 1, 300)[:, None]
    columns = np.exp(-((x / widths) ** 2))
    columns /= np.linalg.norm(columns, axis=0)
    target = rng.random(8) @ np.exp(-((x / rng.uniform(0.02, 0.9, 8)) ** 2)).T
    target -= 0.3 * rng.random() * np.exp(-((x[:, 0] / 0.1) ** 2))
    return columns.T @ columns + ridge**2 * np.eye(40), columns.T @ target


@pytest.mark.parametrize("ridge", [1e-2, 1e-4, 1e-6])
def test_partly_ill_conditioned(ridge):
    """Optimal by the conditions of Karush, Kuhn and Tucker, for each set of free unknowns."""
    rng = np.random.default_rng(8)
    conditions = []
    for share in np.repeat([1.0, 0.8, 0.5, 0.1], 8):
        matrix, right = lean_columns(rng, ridge)
        conditions.append(np.linalg.cond(matrix))
        nonnegative = rng.random(40) < share
        x = solve_partly_nonnegative(matrix, right, nonnegative)
        assert (x[nonnegative] >= 0).all()
        gradient = (right - matrix @ x) / np.abs(right).max()
        # nothing is to be gained by raising a number, nor by lowering one that is not 0
        assert gradient.max() < 1e-6
        assert np.abs(gradient[(x != 0) | ~nonnegative]).max() < 1e-6
    assert min(conditions) > 0.1 / ridge**2


@pytest.mark.parametrize("scale", [1e-20, 1e20])
def test_partly_units_do_not_matter(scale):
    matrix, right = (part[0] for part in random_problems(7, rows=9, seed=10, n=1))
    mask = np.array(MASKS["mixed"])
    expected = solve_partly_nonnegative(matrix, right, mask)
    assert (expected[mask] > 0).any()
    got = solve_partly_nonnegative(matrix, scale * right, mask)
    np.testing.assert_allclose(got, scale * expected, rtol=1e-9)


@pytest.mark.filterwarnings("error")
def test_partly_when_two_unknowns_vanish_at_once():
    matrix = np.array([[1, 0, 0.5], [0, 1, 0.5], [0.5, 0.5, 1]])
    x = solve_partly_nonnegative(matrix, np.array([1.0, 1, 2]), np.ones(3, bool))
    np.testing.assert_allclose(x, [0, 0, 2], atol=1e-12)


def test_partly_nothing_to_fit():
    x = solve_partly_nonnegative(np.eye(4), np.zeros(4), np.array([True, False, True, True]))
    np.testing.assert_array_equal(x, 0)


def test_partly_nothing_at_all():
    assert solve_partly_nonnegative(np.eye(0), np.zeros(0), np.zeros(0, bool)).shape == (0,)


def test_partly_inputs_are_not_modified():
    matrix, right = (part[0] for part in random_problems(7, rows=9, seed=5, n=1))
    mask = np.array(MASKS["mixed"])
    before = matrix.copy(), right.copy(), mask.copy()
    solve_partly_nonnegative(matrix, right, mask)
    for array, old in zip((matrix, right, mask), before, strict=True):
        np.testing.assert_array_equal(array, old)


# ---- many problems, some unknowns free ----


def many_problems(size=9, n=12, count=25):
    """A few matrices and many right sides for each."""
    matrix, _ = random_problems(size, rows=12, seed=11, n=n)
    right = np.random.default_rng(12).standard_normal((n, count, size))
    return matrix, right


@pytest.mark.parametrize("mask", MASKS.values(), ids=MASKS)
@pytest.mark.parametrize("guess", [False, True])
def test_many_equal_one_by_one(mask, guess):
    mask = np.array(mask)
    matrix, right = many_problems(len(mask))
    start = np.random.default_rng(13).standard_normal(right.shape) if guess else None
    got = PartlyNonnegative(matrix, mask).solve(right, start)
    expected = [
        [solve_partly_nonnegative(a, b, mask) for b in rows]
        for a, rows in zip(matrix, right, strict=True)
    ]
    np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-9)
    if mask.any():
        assert 0.1 < np.mean(got[..., mask] > 0) < 0.9
        assert (got[..., mask] >= 0).all()


def test_what_pivoting_leaves_is_solved_too(monkeypatch):
    monkeypatch.setattr(nnls, "_MOST_EXCHANGES", 1)
    test_many_equal_one_by_one(MASKS["mixed"], False)


def test_many_ill_conditioned():
    rng = np.random.default_rng(8)
    for share in (1.0, 0.8, 0.5):
        matrix, right = lean_columns(rng, 1e-2)
        nonnegative = rng.random(40) < share
        x = PartlyNonnegative(matrix[None], nonnegative).solve(right[None, None])[0, 0]
        gradient = (right - matrix @ x) / np.abs(right).max()
        assert (x[nonnegative] >= 0).all()
        assert gradient.max() < 1e-6
        assert np.abs(gradient[(x != 0) | ~nonnegative]).max() < 1e-6


def test_many_inputs_are_not_modified():
    matrix, right = many_problems(7)
    mask, start = np.array(MASKS["mixed"]), np.ones(right.shape)
    before = [part.copy() for part in (matrix, right, mask, start)]
    PartlyNonnegative(matrix, mask).solve(right, start)
    for array, old in zip((matrix, right, mask, start), before, strict=True):
        np.testing.assert_array_equal(array, old)


def test_descent_reaches_the_solution():
    matrix, right = (part[0] for part in random_problems(4, rows=9, seed=6, n=1))
    expected = solve_nonnegative(matrix[None], right[None])[0]
    every = np.ones(4, bool)
    x = descend(matrix, right, np.ones(4), np.zeros(4), every, passes=5000)
    np.testing.assert_allclose(x, expected, atol=1e-9)


def test_no_pass_of_the_descent_raises_the_value():
    matrix, right = (part[0] for part in random_problems(7, rows=9, seed=7, n=1))
    least = np.full(7, 0.1)
    x, values = np.full(7, 3.0), []
    for _ in range(20):
        values.append(x @ matrix @ x - 2 * right @ x)
        x = descend(matrix, right, x, least, np.ones(7, bool), passes=1)
    assert (np.diff(values) <= 1e-12).all()
    assert values[-1] < values[0]
    assert x.min() >= 0.1


def test_descent_leaves_what_is_not_free():
    matrix, right = (part[0] for part in random_problems(5, rows=9, seed=8, n=1))
    free = np.array([True, False, True, False, True])
    start = np.arange(5.0)
    x = descend(matrix, right, start, np.zeros(5), free, passes=3)
    np.testing.assert_array_equal(x[~free], start[~free])
    assert (x[free] != start[free]).all()
    np.testing.assert_array_equal(start, np.arange(5.0))
