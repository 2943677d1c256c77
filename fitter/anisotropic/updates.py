# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternating weighted least squares on the UTIA grid (Peng et al. 2017, section 2.4).

As `updates`, with neighbouring numbers of D and F coupled by the linear interpolation: their
normal equations are solved together, D for all lobes at once. No update raises the objective.

No number of a factor falls below a small share of its maximum: what is zero would stay zero in the
joint steps that follow, which move logarithms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import nnls, polar_grid
from ..fitting.order import FRESNEL_FLOOR, MASKING_FLOOR, NDF_FLOOR
from ..fitting.updates import NEGLIGIBLE, best_masking, with_diffuse_and_scale
from ..models.anisotropic_model import AnisotropicModel
from .problem import AnisotropicProblem

# Of the coordinate descent; the next sweep continues where this one stops.
PASSES = 3


def update_diffuse_and_scale(
    problem: AnisotropicProblem, model: AnisotropicModel
) -> AnisotropicModel:
    """The best d_c and s_mc >= 0, jointly for each channel."""
    unscaled = problem.lobe_values(replace(model, scale=np.ones_like(model.scale)))
    columns = np.concatenate([unscaled, np.ones_like(unscaled[:1])])  # lobes + 1, 3, n
    matrix = np.einsum("mcn,kcn,cn->cmk", columns, columns, problem.weight, optimize=True)
    right = np.einsum("mcn,cn->cm", columns, problem.weighted_target)
    return _better(
        problem, model, with_diffuse_and_scale(model, nnls.solve_nonnegative(matrix, right))
    )


def update_ndf(problem: AnisotropicProblem, model: AnisotropicModel) -> AnisotropicModel:
    """D of all lobes jointly, lowered by coordinate descent; negligible numbers are held."""
    n_lobes, size = model.n_lobes, polar_grid.N_FREE
    kernels = problem.kernels(model.masking)
    fresnel = problem.fresnel(model)
    factor = model.scale[:, :, None] * fresnel * kernels[:, None]  # f = d + sum factor D
    residual = problem.weighted_target - model.diffuse[:, None] * problem.weight
    matrix = np.empty((n_lobes, size, n_lobes, size))
    right = np.empty((n_lobes, size))
    for m in range(n_lobes):
        right[m] = problem.half.gathered((factor[m] * residual).sum(0))
        for k in range(m, n_lobes):
            coupling = (factor[m] * factor[k] * problem.weight).sum(0)
            block = problem.product_sums(problem.half, problem.half, coupling)
            matrix[m, :, k], matrix[k, :, m] = block, block.T
    free = _descended(
        matrix.reshape(n_lobes * size, -1), right, polar_grid.free_numbers(model.ndf), NDF_FLOOR
    )
    return replace(model, ndf=polar_grid.full_tables(free))


def update_fresnel(problem: AnisotropicProblem, model: AnisotropicModel) -> AnisotropicModel:
    """F of every channel, lowered by coordinate descent; negligible numbers are held."""
    level = problem.lobe_values(replace(model, fresnel=np.ones_like(model.fresnel))).sum(0)
    residual = problem.weighted_target - model.diffuse[:, None] * problem.weight
    fresnel = np.empty_like(model.fresnel)
    for c in range(3):
        matrix = problem.product_sums(
            problem.difference, problem.difference, level[c] ** 2 * problem.weight[c]
        )
        right = problem.difference.gathered(level[c] * residual[c])[None]
        fresnel[c] = _descended(matrix, right, model.fresnel[c : c + 1], FRESNEL_FLOOR)[0]
    return replace(model, fresnel=fresnel)


def update_masking(
    problem: AnisotropicProblem, model: AnisotropicModel, lobe: int
) -> AnisotropicModel:
    """The extended AWLS for one G: every node in turn, set to its exact best value.

    Data stands at the nodes themselves, so a node touches the pairs that it is part of, as wi (eq.
    5), as wo (eq. 6) or as both (eq. 7).
    """
    n = polar_grid.N_FREE
    values = problem.lobe_values(model)
    others = model.diffuse[:, None] + values.sum(0) - values[lobe]
    unmasked = replace(model, masking=np.ones_like(model.masking))
    y = problem.lobe_values(unmasked)[lobe]
    z = problem.weighted_target - problem.weight * others
    square = np.bincount(problem.pair_index, (problem.weight * y * y).sum(0), n * n).reshape(n, n)
    right = np.bincount(problem.pair_index, (y * z).sum(0), n * n).reshape(n, n)
    free = polar_grid.free_numbers(model.masking)
    least = min(MASKING_FLOOR * free[lobe].max(), free[lobe].min())
    free[lobe] = best_masking(square + square.T, right + right.T, np.eye(n), free[lobe], least)
    return replace(model, masking=polar_grid.full_tables(free))


def sweep(
    problem: AnisotropicProblem, model: AnisotropicModel, *, hold_lobes: bool = False
) -> AnisotropicModel:
    """One round of alternating updates, in the order of fit.sweep; hold_lobes as there."""
    for _ in range(2):
        if not hold_lobes:
            model = update_diffuse_and_scale(problem, model)
            model = update_ndf(problem, model)
        model = update_fresnel(problem, model)
    model = update_diffuse_and_scale(problem, model)
    for lobe in range(model.n_lobes):
        model = update_masking(problem, model, lobe)
    return model.normalized()


def _descended(
    matrix: np.ndarray, right: np.ndarray, factor: np.ndarray, floor: float
) -> np.ndarray:
    """Rows of a factor (rows, k) nearer to the solution of their joint normal equations."""
    energy = np.diag(matrix).reshape(factor.shape)
    free = energy > NEGLIGIBLE * energy.max(axis=1, keepdims=True)
    least = np.minimum(factor, floor * factor.max(axis=1, keepdims=True))
    columns = (right.ravel(), factor.ravel(), least.ravel(), free.ravel())
    return nnls.descend(matrix, *columns, PASSES).reshape(factor.shape)


def _better(
    problem: AnisotropicProblem, before: AnisotropicModel, after: AnisotropicModel
) -> AnisotropicModel:
    """The better of two models: floors must not undo what a solve has won."""
    return after if problem.objective_of(after) <= problem.objective_of(before) else before
