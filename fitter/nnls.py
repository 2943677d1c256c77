# SPDX-License-Identifier: GPL-3.0-or-later
"""Non-negative least squares: many small problems at once, and single larger ones.

The closed-form updates of the isotropic model couple at most four unknowns, so every active set can
be tried: 2^4 - 1 solves, vectorised over the problems, instead of an iterative method for each.
"""

from __future__ import annotations

import itertools

import numpy as np


def solve_nonnegative(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Minimise x' A x - 2 b' x over x >= 0 for matrices A (n, k, k) and vectors b (n, k).

    A must be symmetric and positive semidefinite. Returns x (n, k).
    """
    n_problems, size = right.shape
    # equilibrate: the unknowns may differ by many orders of magnitude
    diagonal = np.einsum("nii->ni", matrix)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1))
    matrix = matrix * scale[:, :, None] * scale[:, None, :]
    right = right * scale
    best = np.zeros((n_problems, size))
    best_value = np.zeros(n_problems)
    for count in range(1, size + 1):
        for free in itertools.combinations(range(size), count):
            block = matrix[:, free][:, :, free]
            # a ridge far below the data keeps nearly dependent lobes solvable
            ridged = block + 1e-12 * np.eye(count)
            x = np.linalg.solve(ridged, right[:, free, None])[..., 0]
            value = np.einsum("ni,nij,nj->n", x, block, x) - 2 * (right[:, free] * x).sum(-1)
            better = (x >= 0).all(-1) & (value < best_value)
            candidate = np.zeros((n_problems, size))
            candidate[:, free] = x
            best[better] = candidate[better]
            best_value[better] = value[better]
    return best * scale


def solve_partly_nonnegative(
    matrix: np.ndarray, right: np.ndarray, nonnegative: np.ndarray
) -> np.ndarray:
    """Minimise x' A x - 2 b' x with x[nonnegative] >= 0 for one positive definite A (k, k).

    The active-set method of Lawson and Hanson 1974 (ch. 23) on the normal equations, as Bro and
    de Jong 1997, with the unconstrained variables free from the start. Returns x (k,).
    """

    def solve_free() -> np.ndarray:
        out = np.zeros(len(right))
        out[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
        return out

    free = ~nonnegative
    x = solve_free()
    tolerance = 1e-9 * np.abs(right).max(initial=0)
    for _ in range(3 * len(right)):  # the method ends by itself; this bounds rounding's cycles
        gradient = np.where(free, -np.inf, right - matrix @ x)
        candidate = int(gradient.argmax())
        if not gradient[candidate] > tolerance:
            break
        free[candidate] = True
        while True:
            step = solve_free()
            negative = free & nonnegative & (step <= 0)
            if not negative.any():
                x = step
                break
            # go as far as the first variable allows, and fix it at 0
            share = x[negative] / (x[negative] - step[negative])
            first = np.flatnonzero(negative)[share.argmin()]
            x = x + share.min() * (step - x)
            free[first] = False
            x[~free] = 0
    return x


class PartlyNonnegative:
    """Minimisers of x' A x - 2 b' x with some x >= 0: few matrices, many right sides.

    matrix : (n, k, k), positive definite
    nonnegative : (k,) which x must not be below 0, the same for all

    The unconstrained variables are eliminated once for each matrix; what is left are small
    problems, solved all at once by `_pivot`. The same minimisers as those of
    `solve_partly_nonnegative`, for well-conditioned matrices and many times faster.
    """

    def __init__(self, matrix: np.ndarray, nonnegative: np.ndarray) -> None:
        self._bound, self._open = np.flatnonzero(nonnegative), np.flatnonzero(~nonnegative)
        self._inner = matrix[:, self._open][:, :, self._open]
        self._cross = matrix[:, self._open][:, :, self._bound]
        self._inverse = np.linalg.inv(self._inner)
        self._carry = self._eliminate(self._cross)
        reduced = matrix[:, self._bound][:, :, self._bound]
        self._reduced = reduced - self._cross.transpose(0, 2, 1) @ self._carry

    def solve(self, right: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """Minimisers (n, r, k) for right sides (n, r, k).

        start : (n, r, k) a guess; where it is positive tells which conditions to begin with
        """
        x = np.empty(right.shape)
        given = right[:, :, self._open]
        reduced = right[:, :, self._bound] - given @ self._carry
        positive = None if start is None else start[:, :, self._bound] > 0
        x[:, :, self._bound] = bound = _pivot(self._reduced, reduced, positive)
        remaining = given - bound @ self._cross.transpose(0, 2, 1)
        x[:, :, self._open] = self._eliminate(remaining.transpose(0, 2, 1)).transpose(0, 2, 1)
        return x

    def _eliminate(self, right: np.ndarray) -> np.ndarray:
        """Unconstrained variables (n, open, r) for right sides (n, open, r)."""
        x = self._inverse @ right
        # an inverse alone loses digits that a solver would keep
        return x + self._inverse @ (right - self._inner @ x)


# Exchanges that _pivot tries. It mostly needs about ten; now and then it runs in circles.
_MOST_EXCHANGES = 30


def _pivot(matrix: np.ndarray, right: np.ndarray, positive: np.ndarray | None) -> np.ndarray:
    """Minimisers (n, r, k) >= 0 for A (n, k, k) and b (n, r, k).

    Block principal pivoting (Kim and Park 2011, "Fast nonnegative matrix factorization: an
    active-set-like method"): exchange all variables that violate a condition, in all problems
    at once. What it does not solve is left to the method of Lawson and Hanson.
    """
    n, count, size = right.shape
    right = right.reshape(n * count, size)
    owner = np.repeat(np.arange(n), count)
    free = np.zeros(right.shape, bool) if positive is None else positive.reshape(right.shape)
    free = free.copy()
    x = np.zeros(right.shape)
    tolerance = 1e-9 * np.abs(right).max(1, initial=0, keepdims=True)
    left = np.arange(len(right))  # problems that are not solved yet
    for _ in range(_MOST_EXCHANGES):
        active, blocks = free[left], matrix[owner[left]]
        inner = np.where(active[:, :, None] & active[:, None, :], blocks, np.eye(size))
        x[left] = np.linalg.solve(inner, np.where(active, right[left], 0)[..., None])[..., 0]
        gradient = np.einsum("nij,nj->ni", blocks, x[left]) - right[left]
        violating = np.where(active, x[left], gradient) < -tolerance[left]
        unsolved = violating.any(1)
        left, violating = left[unsolved], violating[unsolved]
        if not len(left):
            break
        free[left] ^= violating
    for i in left:
        x[i] = solve_partly_nonnegative(matrix[owner[i]], right[i], np.ones(size, bool))
    return np.maximum(x, 0).reshape(n, count, size)


def descend(
    matrix: np.ndarray,
    right: np.ndarray,
    start: np.ndarray,
    least: np.ndarray,
    free: np.ndarray,
    passes: int,
) -> np.ndarray:
    """Lower x' A x - 2 b' x over x >= least by coordinate descent from start (k,): a new x (k,).

    For hundreds of unknowns with a good start. Each step is the exact minimum over one unknown, so
    no pass raises the value. Unknowns that are not free (k,) stay as they are.
    """
    x = start.copy()
    gradient = matrix @ x - right
    moving = np.flatnonzero(free & (np.diag(matrix) > 0))
    for _ in range(passes):
        for k in moving:
            change = max(least[k], x[k] - gradient[k] / matrix[k, k]) - x[k]
            if change:
                gradient += matrix[k] * change
                x[k] += change
    return x
