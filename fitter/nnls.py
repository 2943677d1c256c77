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
