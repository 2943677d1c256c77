# SPDX-License-Identifier: GPL-3.0-or-later
"""Alternating weighted least squares: the exact minimum over one factor, the others held.

Bagher et al. 2016 give the updates of d, s, D and F; Peng et al. 2017, section 2.3, extend the
method to G. None of them can raise the objective. Unknowns that are coupled by a small linear
system are solved together (d and s of a channel; the D of all lobes in a theta_h bin), which
converges faster than one factor after another and is the same fixed point.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..models.factors import AnyFactors
from ..models.model import FactorModel
from ..nnls import solve_nonnegative
from .problem import Moments, Problem, amplitudes

# A scale of exactly zero would also zero the D of its lobe in the next update, and the lobe could
# never come back.
SCALE_FLOOR = 1e-6

# A number whose share of the normal equations is this much smaller than the largest of its factor
# is held. It could matter only by growing to ten thousand times the factor's maximum, and would
# (D near 90 degrees, where G is zero).
NEGLIGIBLE = 1e-8


def update_diffuse_and_scale(problem: Problem, moments: Moments, model: FactorModel) -> FactorModel:
    """The best d_c and s_mc >= 0, jointly for each channel."""
    shape = amplitudes(replace(model, scale=np.ones_like(model.scale)))
    n_lobes = model.n_lobes
    matrix = np.empty((3, n_lobes + 1, n_lobes + 1))
    matrix[:, :n_lobes, :n_lobes] = np.einsum(
        "hdmc,hdmkc,hdkc->cmk", shape, moments.kernel_kernel, shape, optimize=True
    )
    border = (shape * moments.kernel).sum((0, 1)).T
    matrix[:, :n_lobes, n_lobes] = matrix[:, n_lobes, :n_lobes] = border
    matrix[:, n_lobes, n_lobes] = problem.cell_weight.sum((0, 1))
    right = np.empty((3, n_lobes + 1))
    right[:, :n_lobes] = (shape * moments.kernel_target).sum((0, 1)).T
    right[:, n_lobes] = problem.cell_target.sum((0, 1))
    after = with_diffuse_and_scale(model, solve_nonnegative(matrix, right))
    return _better(problem, moments, model, after)


def with_diffuse_and_scale(model: AnyFactors, solution: np.ndarray) -> AnyFactors:
    """The model with the s_mc and d_c of a solution (3, lobes + 1), no lobe dead."""
    scale = solution[:, :-1].T
    # where the data wants none of the lobes as they are, the floor comes from what they had
    floored = np.maximum(scale, SCALE_FLOOR * (scale.max() or model.scale.max()))
    return replace(model, scale=floored, diffuse=solution[:, -1])


def update_ndf(problem: Problem, moments: Moments, model: FactorModel) -> FactorModel:
    """The best D_m >= 0, jointly for the lobes of each theta_h bin; negligible ones are held."""
    factor = model.scale[None] * model.fresnel.T[:, None, :]
    matrix = np.einsum("dmc,hdmkc,dkc->hmk", factor, moments.kernel_kernel, factor, optimize=True)
    residual = moments.kernel_target - model.diffuse * moments.kernel
    right = np.einsum("dmc,hdmc->hm", factor, residual, optimize=True)
    energy = np.einsum("hmm->hm", matrix)
    held = energy <= NEGLIGIBLE * energy.max(axis=0)
    fixed = np.where(held, model.ndf.T, 0)
    right = np.where(held, 0, right - np.einsum("hmk,hk->hm", matrix, fixed))
    matrix = np.where(held[:, :, None] | held[:, None, :], 0, matrix)
    solution = solve_nonnegative(matrix, right) + fixed
    return _better(problem, moments, model, replace(model, ndf=solution.T))


def update_fresnel(problem: Problem, moments: Moments, model: FactorModel) -> FactorModel:
    """The best F_c >= 0 of every theta_d bin; negligible ones are held."""
    factor = model.scale[None] * model.ndf.T[:, :, None]
    energy = np.einsum("hmc,hdmkc,hkc->cd", factor, moments.kernel_kernel, factor, optimize=True)
    residual = moments.kernel_target - model.diffuse * moments.kernel
    right = np.einsum("hmc,hdmc->cd", factor, residual, optimize=True)
    held = energy <= NEGLIGIBLE * energy.max(axis=1, keepdims=True)
    fresnel = np.maximum(right / np.where(held, 1, energy), 0)
    return replace(model, fresnel=np.where(held, model.fresnel, fresnel))


def update_masking(
    problem: Problem, kernels: np.ndarray, model: FactorModel, lobe: int
) -> FactorModel:
    """The extended AWLS for one G, see `best_masking`.

    kernels : (lobes, 8100, n_phi) of the present model
    """
    pair_matrix, pair_right = masking_normal_equations(problem, kernels, model, lobe)
    masking = model.masking.copy()
    masking[lobe] = best_masking(pair_matrix, pair_right, problem.basis, masking[lobe])
    return replace(model, masking=masking)


def best_masking(
    pair_matrix: np.ndarray,
    pair_right: np.ndarray,
    basis: np.ndarray,
    control: np.ndarray,
    least: float = 0.0,
) -> np.ndarray:
    """The extended AWLS: every control point of one G in turn, set to its exact best value.

    With x one control point of G, G(theta_i) = a_i + c_i x and G(theta_o) = a_o + c_o x. In the
    three situations of eqs. 5-7 (x touches only theta_i, only theta_o, or both) the squared error
    is a polynomial of degree 2, 2 or 4, so the derivative of the sum is a cubic. Its real roots,
    the least value allowed and the present value are compared by their objective, and the best is
    kept.

    pair_matrix, pair_right : (n, n) sums over pairs of angles, see masking_normal_equations
    basis : (n, k) takes control points to u at the angles
    control : (k,) control points now; the result is new
    """
    control = control.copy()
    u = basis @ control
    # With q = u^2, the objective is q' A q / 2 - u' B u: A, B symmetric. A q and B u are kept up
    # to date; one control point changes u only on the few bins of its support.
    matrix_q, right_u = pair_matrix @ (u * u), pair_right @ u
    for k in range(len(control)):
        support = np.flatnonzero(basis[:, k])
        s = slice(support[0], support[-1] + 1)
        slope, present = basis[s, k], control[k]
        base = u[s] - slope * present
        block, right_block = pair_matrix[s, s], pair_right[s, s]
        # q = q0 + q1 x + q2 x^2 on the support
        q0, q1, q2 = base * base, 2 * base * slope, slope * slope
        matrix_q0 = matrix_q[s] + block @ (q0 - u[s] ** 2)
        right_base = right_u[s] - right_block @ (slope * present)
        polynomial = (
            q1 @ matrix_q0 - 2 * (slope @ right_base),
            q2 @ matrix_q0 + 0.5 * (q1 @ block @ q1) - slope @ right_block @ slope,
            q1 @ block @ q2,
            0.5 * (q2 @ block @ q2),
        )
        best = _minimum_of_quartic(polynomial, present, least)
        if best == present:
            continue
        after = base + slope * best
        matrix_q += pair_matrix[:, s] @ (after * after - u[s] ** 2)
        right_u += pair_right[:, s] @ (after - u[s])
        u[s] = after
        control[k] = best
    return control


def masking_normal_equations(
    problem: Problem, kernels: np.ndarray, model: FactorModel, lobe: int
) -> tuple[np.ndarray, np.ndarray]:
    """Symmetric (n, n) sums over pairs of angle bins of w y^2 and w y z (eqs. 5-7)."""
    others = [k for k in range(model.n_lobes) if k != lobe]
    a = amplitudes(model).reshape(-1, model.n_lobes, 3)
    y = a[:, lobe]
    columns = [y * y, y * model.diffuse, *(y * a[:, k] for k in others)]
    weighted = problem.weight @ np.stack(columns, -1)
    square = weighted[..., 0]
    right = (problem.weighted_target @ y[..., None])[..., 0] - weighted[..., 1]
    for column, k in enumerate(others, start=2):
        right -= weighted[..., column] * kernels[k]
    matrix, vector = problem.pair_table(square), problem.pair_table(right)
    return matrix + matrix.T, vector + vector.T


def _minimum_of_quartic(
    coefficients: tuple[float, ...], present: float, least: float = 0.0
) -> float:
    """Where c1 x + c2 x^2 + c3 x^3 + c4 x^4 has its minimum over x >= least.

    `present` if nothing is lower.
    """
    c1, c2, c3, c4 = coefficients
    if not c4 > 0:
        return present  # no data sees this control point

    def value(x: float) -> float:
        return (((c4 * x + c3) * x + c2) * x + c1) * x

    roots = _real_cubic_roots(4 * c4, 3 * c3, 2 * c2, c1)
    candidates = [least, *(x for x in roots if x > least)]
    best = min(candidates, key=value)
    return best if value(best) < value(present) else present


def _real_cubic_roots(a: float, b: float, c: float, d: float) -> list[float]:
    """Real roots of a x^3 + b x^2 + c x + d, a != 0 (Cardano; trigonometric when there are 3)."""
    shift = b / (3 * a)
    p = (3 * a * c - b * b) / (9 * a * a)
    q = (2 * b**3 - 9 * a * b * c + 27 * a * a * d) / (54 * a**3)
    discriminant = q * q + p**3
    if discriminant > 0:
        root = np.sqrt(discriminant)
        # the larger of the two cube roots first: the other follows without cancellation
        t = np.cbrt(-q + root) if q < 0 else np.cbrt(-q - root)
        return [float(t - (p / t if t else 0) - shift)]
    if p == 0:
        return [float(-shift)]
    angle = np.arccos(np.clip(-q / np.sqrt(-(p**3)), -1, 1)) / 3
    return [float(2 * np.sqrt(-p) * np.cos(angle - 2 * np.pi * k / 3) - shift) for k in range(3)]


def _better(
    problem: Problem, moments: Moments, before: FactorModel, after: FactorModel
) -> FactorModel:
    """The better of two models: floors and rounding must not undo what a solve has won."""
    if problem.objective(after, moments) <= problem.objective(before, moments):
        return after
    return before
