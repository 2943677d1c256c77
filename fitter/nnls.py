# SPDX-License-Identifier: GPL-3.0-or-later
"""Many small non-negative least-squares problems at once.

The closed-form updates couple at most four unknowns, so every active set can be tried: 2^4 - 1
solves, vectorised over the problems, instead of an iterative method for each problem.
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
