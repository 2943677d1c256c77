# SPDX-License-Identifier: GPL-3.0-or-later
"""Levenberg-Marquardt on all 822 numbers at once, after the alternation has found the valley.

Alternating updates crawl where factors trade off against each other (D against F against G). One
joint step uses the full Gauss-Newton matrix. It is never assembled from a Jacobian: every block is
a sum of the same aggregated moments as in `problem`, or of their analogue over angle bins.

All factors and scales move in log space: they stay positive without bounds to watch, and products
of factors become sums. A number that the alternation has set to exactly zero (log = -inf) has no
derivative there and stays zero until the next alternation. d moves linearly: it is zero for metals
and must be able to leave zero.

Near the mirror direction theta_i = theta_o = theta_d, so for a sharp lobe F and 1 / G^2 are nearly
interchangeable and steps would drift along F e^(k theta) without end; and numbers that the data
hardly sees (D near 90 degrees) would drift anywhere. The step therefore prefers level factors, F
most: the normal equations get a penalty on the differences of log factors between neighbours. It
steers the step only; whether a step is taken depends on the objective alone.

Reference for the damping: Marquardt 1963, with his scaling by the diagonal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement, pairwise
from typing import Protocol, TypeVar

import numpy as np

from ..geometry import N_THETA_D, N_THETA_H
from ..models.factors import AnyFactors, Factors
from ..models.model import FactorModel
from ..models.splines import N_MASKING
from . import prior
from .appearance import AppearanceError
from .problem import Moments, Problem, amplitudes

# A step may change a number by at most this factor (e^2); the quadratic model is worthless beyond.
MAX_LOG_STEP = 2.0

DAMPING_START = 1e-3
DAMPING_DOWN = 0.3
DAMPING_UP = 4.0
MAX_REJECTIONS = 8


class WeightedSamples(Protocol):
    """What can be fitted: an objective E relative to sum w rho^2."""

    target_energy: float

    def objective_of(self, model: Factors) -> float:
        """E of a model."""


P = TypeVar("P", bound=WeightedSamples)

# E, J' W J and J' W (rho - f) in the coordinates of a layout.
Equations = tuple[float, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Layout:
    """Where each factor stands in the parameter vector: log D, log F, log G, log s, d."""

    n_lobes: int
    ndf: slice
    fresnel: slice
    masking: slice
    scale: slice
    diffuse: slice
    size: int

    @classmethod
    def of(cls, model: Factors) -> Layout:
        """Layout of a model's free numbers."""
        ends = np.cumsum([0, *(a.size for a in _moved_logarithmically(model)), 3])
        return cls(model.n_lobes, *(slice(a, b) for a, b in pairwise(ends)), ends[-1])

    def pack(self, model: Factors) -> np.ndarray:
        """Parameter vector of a model."""
        return np.concatenate([*map(_log, _moved_logarithmically(model)), model.diffuse])

    def unpack(self, x: np.ndarray, like: AnyFactors) -> AnyFactors:
        """Model of a parameter vector, of the kind of another."""

        def rows(part: slice) -> np.ndarray:
            return np.exp(x[part]).reshape(self.n_lobes, -1)

        return replace(
            like,
            diffuse=np.maximum(x[self.diffuse], 0),
            scale=rows(self.scale),
            ndf=like.full_tables(rows(self.ndf)),
            masking=like.full_tables(rows(self.masking)),
            fresnel=np.exp(x[self.fresnel]).reshape(3, -1),
        )


def objective_of(
    problem: P, model: Factors, strength: float, appearance: AppearanceError | None = None
) -> float:
    """What the steps minimise: (E + error of appearance) e^disorder."""
    error = problem.objective_of(model) + (appearance.value(model) if appearance else 0)
    return error * np.exp(prior.disorder(model, strength))


def refine(
    problem: P,
    model: AnyFactors,
    strength: float = 0.0,
    appearance: AppearanceError | None = None,
    *,
    equations: Callable[[P, AnyFactors, Layout], Equations] | None = None,
) -> Iterator[tuple[AnyFactors, float]]:
    """Yield (model, objective) after every accepted step; ends when no step lowers it.

    strength : of the prior, which is part of the objective
    appearance : of an isotropic measurement; part of the objective too, if given
    equations : for problems of another kind than Problem; default: normal_equations
    """
    equations = equations or normal_equations
    layout = Layout.of(model)
    model = model.normalized()
    damping = DAMPING_START
    while True:
        x = layout.pack(model)
        value, normal, gradient = equations(problem, model, layout)
        if appearance:
            value += _add_appearance(problem, model, appearance, normal, gradient)
        objective = value * np.exp(prior.disorder(model, strength))
        _add_prior(problem, model, strength, value, layout, normal, gradient)
        scale = _scale_of(normal)
        normal *= np.outer(scale, scale)
        diagonal = np.diag(normal).copy()
        for _ in range(MAX_REJECTIONS):
            np.fill_diagonal(normal, diagonal + damping)
            step = np.linalg.solve(normal, gradient * scale) * scale
            step[: layout.diffuse.start] = np.clip(
                step[: layout.diffuse.start], -MAX_LOG_STEP, MAX_LOG_STEP
            )
            trial = layout.unpack(x + step, model).normalized()
            after = objective_of(problem, trial, strength, appearance)
            if after < objective:
                break
            damping *= DAMPING_UP
        else:
            return
        damping = max(damping * DAMPING_DOWN, 1e-9)
        model = trial
        yield model, after


def _scale_of(normal: np.ndarray) -> np.ndarray:
    """What gives a normal matrix (n, n) a diagonal of ones."""
    diagonal = np.diag(normal)
    return 1 / np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max()))


def normal_equations(problem: Problem, model: FactorModel, layout: Layout) -> Equations:
    """Equations of the isotropic model."""
    kernels = problem.kernels(model.masking)
    moments = problem.moments(kernels)
    normal = np.zeros((layout.size, layout.size))
    gradient = np.zeros(layout.size)
    _fill_cell_blocks(problem, moments, model, layout, normal, gradient)
    _fill_masking_blocks(problem, kernels, model, layout, normal, gradient)
    upper = np.triu(normal, 1)
    normal = upper + upper.T + np.diag(np.diag(normal))
    return problem.objective(model, moments), normal, gradient


def _add_appearance(
    problem: Problem,
    model: FactorModel,
    appearance: AppearanceError,
    normal: np.ndarray,
    gradient: np.ndarray,
) -> float:
    """Add J' J and -J' r of the error of appearance, and return it."""
    residual, jacobian = appearance.residual_and_jacobian(model)
    normal += problem.target_energy * (jacobian.T @ jacobian)
    gradient -= problem.target_energy * (jacobian.T @ residual.astype(jacobian.dtype))
    return float(residual @ residual)


def _add_prior(
    problem: P,
    model: Factors,
    strength: float,
    objective: float,
    layout: Layout,
    normal: np.ndarray,
    gradient: np.ndarray,
) -> None:
    """Add J' J and -J' r of the disorder: d(E e^disorder) = e^disorder (dE + E d disorder)."""
    scale = np.sqrt(objective * problem.target_energy)
    for name, terms in prior.terms(model, strength).items():
        position = getattr(layout, name).start + terms.index
        slope, value = scale * terms.slope, scale * terms.value
        np.add.at(gradient, position, -slope * value[:, None])
        for a in range(3):
            for b in range(3):
                np.add.at(normal, (position[:, a], position[:, b]), slope[:, a] * slope[:, b])


def _fill_cell_blocks(
    problem: Problem,
    moments: Moments,
    model: FactorModel,
    layout: Layout,
    normal: np.ndarray,
    gradient: np.ndarray,
) -> None:
    """Upper triangle of everything but G.

    In log space each derivative is a sum of lobe values a_mc K_m, so every block is a sum of
    z = a_m (sum w K_m K_k) a_k over the axes that the block does not have.
    """
    n_lobes = model.n_lobes
    a = amplitudes(model)
    z = a[:, :, :, None, :] * moments.kernel_kernel * a[:, :, None, :, :]  # h d m k c
    value = a * moments.kernel  # h d m c
    residual = a * (moments.kernel_target - model.diffuse * moments.kernel) - z.sum(3)

    gradient[layout.ndf] = residual.sum((1, 3)).T.ravel()
    gradient[layout.fresnel] = residual.sum((0, 2)).T.ravel()
    gradient[layout.scale] = residual.sum((0, 1)).ravel()
    gradient[layout.diffuse] = (
        problem.cell_target - model.diffuse * problem.cell_weight - value.sum(2)
    ).sum((0, 1))

    n_h, n_d = a.shape[:2]
    bins = np.arange(n_h)
    ndf_ndf = np.zeros((n_lobes, n_h, n_lobes, n_h))
    ndf_ndf[:, bins, :, bins] = z.sum((1, 4))
    normal[layout.ndf, layout.ndf] = ndf_ndf.reshape(n_lobes * n_h, -1)
    normal[layout.ndf, layout.fresnel] = (
        z.sum(3).transpose(2, 0, 3, 1).reshape(n_lobes * n_h, 3 * n_d)
    )
    normal[layout.ndf, layout.scale] = (
        z.sum(1).transpose(1, 0, 2, 3).reshape(n_lobes * n_h, n_lobes * 3)
    )
    normal[layout.ndf, layout.diffuse] = value.sum(1).transpose(1, 0, 2).reshape(-1, 3)

    normal[layout.fresnel, layout.fresnel] = np.diag(z.sum((0, 2, 3)).T.ravel())
    channels = np.arange(3)
    fresnel_scale = np.zeros((3, n_d, n_lobes, 3))
    fresnel_scale[channels, :, :, channels] = z.sum((0, 2)).transpose(2, 0, 1)
    normal[layout.fresnel, layout.scale] = fresnel_scale.reshape(3 * n_d, -1)
    fresnel_diffuse = np.zeros((3, n_d, 3))
    fresnel_diffuse[channels, :, channels] = value.sum((0, 2)).T
    normal[layout.fresnel, layout.diffuse] = fresnel_diffuse.reshape(3 * n_d, 3)

    scale_scale = np.zeros((n_lobes, 3, n_lobes, 3))
    scale_scale[:, channels, :, channels] = z.sum((0, 1)).transpose(2, 0, 1)
    normal[layout.scale, layout.scale] = scale_scale.reshape(n_lobes * 3, -1)
    scale_diffuse = np.zeros((n_lobes, 3, 3))
    scale_diffuse[:, channels, channels] = value.sum((0, 1))
    normal[layout.scale, layout.diffuse] = scale_diffuse.reshape(-1, 3)
    normal[layout.diffuse, layout.diffuse] = np.diag(problem.cell_weight.sum((0, 1)))


def _fill_masking_blocks(
    problem: Problem,
    kernels: np.ndarray,
    model: FactorModel,
    layout: Layout,
    normal: np.ndarray,
    gradient: np.ndarray,
) -> None:
    """Upper triangle of the rows and columns of log G.

    With u = basis G, the lobe value a_m u_m(i) u_m(o) has the derivative a_m u_m(o) to u_m at the
    bin of theta_i, and the same with i and o exchanged. Where the other factor of a block is a
    number per lobe or channel, the sum over samples depends on the cell only through a table over
    pairs of angle bins; blocks with D and F need tables over (theta_h or theta_d, angle bin). The
    chain rule through basis * G gives log G at the end.
    """
    n_lobes, n = model.n_lobes, problem.n_angles
    a = amplitudes(model).reshape(-1, n_lobes, 3)
    u = model.masking @ problem.basis.T
    chains = [problem.basis * control for control in model.masking]
    rows = [
        slice(layout.masking.start + m * N_MASKING, layout.masking.start + (m + 1) * N_MASKING)
        for m in range(n_lobes)
    ]
    residuals = []
    for m in range(n_lobes):
        target = problem.pair_table((problem.weighted_target @ a[:, m, :, None])[..., 0])
        residual = _both_sides(target, u[m])
        for c in range(3):
            table = problem.pair_table(problem.weight_of(c) * a[:, m, c, None])
            seen = _both_sides(table, u[m])
            normal[rows[m], layout.diffuse.start + c] = seen @ chains[m]
            residual -= model.diffuse[c] * seen
        residuals.append(residual)

    for m, k in combinations_with_replacement(range(n_lobes), 2):
        orders = {(m, k), (k, m)}
        shared, coupling = np.zeros_like(kernels[m]), np.zeros((n, n))
        for c in range(3):
            product = problem.weight_of(c) * (a[:, m, c] * a[:, k, c])[:, None]
            table = problem.pair_table(product)
            both = _both_sides(table, u[m] * u[k])
            for one, other in orders:
                seen = u[other] * both
                column = layout.scale.start + 3 * other + c
                normal[rows[one], column] = seen @ chains[one]
                residuals[one] -= seen
            shared += product
            coupling += table
        # both derivatives at the same bin, and one at each
        same = np.diag(_both_sides(coupling, u[m] * u[k]))
        crossed = coupling * u[m][None, :] * u[k][:, None]
        crossed += (coupling * u[m][:, None] * u[k][None, :]).T
        normal[rows[m], rows[k]] = chains[m].T @ (same + crossed) @ chains[k]
        for one, other in orders:
            by_h = problem.angle_table(shared * kernels[other], u[one], axis=0)
            ndf_rows = slice(other * N_THETA_H, (other + 1) * N_THETA_H)
            normal[layout.ndf, rows[one]][ndf_rows] = by_h @ chains[one]

    for c in range(3):
        lobe_sum = sum(a[:, m, c, None] * kernels[m] for m in range(n_lobes))
        weighted = problem.weight_of(c) * lobe_sum
        for m in range(n_lobes):
            by_d = problem.angle_table(weighted * a[:, m, c, None], u[m], axis=1)
            fresnel_rows = slice(c * N_THETA_D, (c + 1) * N_THETA_D)
            normal[layout.fresnel, rows[m]][fresnel_rows] = by_d @ chains[m]
    for m in range(n_lobes):
        gradient[rows[m]] = residuals[m] @ chains[m]


def _both_sides(pair_table: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Sum over the other angle of a pair table weighted by u there: theta_i plus theta_o."""
    return pair_table @ u + u @ pair_table


def _moved_logarithmically(model: Factors) -> tuple[np.ndarray, ...]:
    ndf, masking = map(model.free_numbers, (model.ndf, model.masking))
    return ndf, model.fresnel, masking, model.scale


def _log(factor: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(factor).ravel()
