# SPDX-License-Identifier: GPL-3.0-or-later
"""The Independent-G model of Bagher et al. 2016, to compare with: one lobe for each channel.

    f_c(wi, wo) = d_c + s_c D_c(theta_h) F_c(theta_d) G_c(theta_i) G_c(theta_o)
                        / (cos theta_i cos theta_o)

Nothing is shared by the channels: 3 + 3 + 270 + 270 + 270 = 816 numbers.

It is the FactorModel of three lobes of which channel c sees lobe c alone: `scale` is diagonal. So
it has the same look-ups, objective, updates and joint steps as our model, and what a comparison
shows is the model, not the optimiser. Starts, sweeps and steps are as many as in `fit`.

`golden_section=True` fits as Bagher et al. did: alternation only, with the G step that Peng et al.
2017, section 2.3, report of them. It solves for G(theta_i) and G(theta_o) in turn, averages them
and smooths the result; where that raises the objective, a golden-section search finds how far to go
towards it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ..fitting import fit as shared
from ..fitting import joint
from ..fitting.appearance import AppearanceError
from ..fitting.problem import Moments, Problem, amplitudes
from ..fitting.quality import DEFAULT_QUALITY, QUALITIES
from ..fitting.starts import STARTS
from ..fitting.updates import (
    SCALE_FLOOR,
    masking_normal_equations,
    update_fresnel,
    update_masking,
    update_ndf,
)
from ..fitting.weights import DEFAULT_WEIGHT
from ..line_search import golden_section_search
from ..measurement import Measurement
from ..models.model import FactorModel
from ..nnls import solve_nonnegative

CHANNELS = np.arange(3)

# Alternation only gets this many sweeps for a joint step, which takes that much longer.
SWEEPS_PER_JOINT_STEP = 2

# Gaussian over G, in control points; Bagher et al. do not print theirs. That of `fit`.
SMOOTHING_SIGMA = shared.SMOOTHING_SIGMA

MaskingUpdate = Callable[[Problem, np.ndarray, FactorModel, int], FactorModel]


@dataclass(frozen=True)
class IndependentG:
    """The model; lobe c of `factors` is the D and G of channel c, and its scale is diagonal."""

    factors: FactorModel

    @property
    def n_parameters(self) -> int:
        """Count of numbers as the papers have it, 816: zeros off the diagonal are none."""
        return self.factors.n_parameters - 6

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        return self.factors.f_r(wi, wo)


def fit(
    measurement: Measurement,
    *,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    golden_section: bool = False,
) -> IndependentG:
    """Fit with the effort of `fit.fit`: the same starts, as many sweeps and joint steps.

    There is no prior: nobody reads or edits these factors, and it could only cost quality.

    weight : a name in weights.WEIGHTS
    quality : a name in quality.QUALITIES
    golden_section : alternation only, with the G step of Bagher et al. 2016
    """
    work = QUALITIES[quality]
    coarse = Problem(
        measurement,
        weight=weight,
        phi_group=work.coarse_phi_group,
        n_angles=work.coarse_angles,
    )
    improve = _alternate if golden_section else _alternate_and_step
    # those of the finalists are for all starts: a channel that lags in one may lead in another
    explore_steps = work.explore_steps + work.finalists * work.final_steps // work.starts
    explored = [
        improve(coarse, model, work.sweeps, explore_steps)
        for model in (_one_lobe(coarse, start(coarse)) for start in STARTS[: work.starts])
    ]
    model = _best_of_each_channel(coarse, explored)
    objective = coarse.objective_of(model)
    spare = work.refine_steps
    for _ in range(work.refine_steps // shared.REFINE_JOINT_STEPS):
        spare -= shared.REFINE_JOINT_STEPS
        model = improve(coarse, model, 1, shared.REFINE_JOINT_STEPS)
        before, objective = objective, coarse.objective_of(model)
        if before - objective <= shared.CONVERGED * before:
            break
    appearance = AppearanceError.of(measurement, work.maps)
    model = improve(coarse, model, 0, work.appearance_steps + spare, appearance)
    if work.polish_steps:
        fine = Problem(measurement, weight=weight, n_angles=work.polish_angles)
        model = improve(fine, model, 0, work.polish_steps, appearance)
    return IndependentG(model)


def sweep(
    problem: Problem, model: FactorModel, masking_update: MaskingUpdate = update_masking
) -> FactorModel:
    """One round of alternating updates, in the order of `fit.sweep`; scale stays diagonal."""
    kernels = problem.kernels(model.masking)
    moments = problem.moments(kernels)
    for _ in range(2):
        model = update_diffuse_and_scale(problem, moments, model)
        model = update_ndf(problem, moments, model)
        model = update_fresnel(problem, moments, model)
    model = update_diffuse_and_scale(problem, moments, model)
    for channel in CHANNELS:
        model = masking_update(problem, kernels, model, channel)
        kernels[channel] = problem.kernels(model.masking[channel : channel + 1])[0]
    return model.normalized()


def update_diffuse_and_scale(problem: Problem, moments: Moments, model: FactorModel) -> FactorModel:
    """The best d_c and s_cc >= 0, jointly for each channel."""
    shape = amplitudes(replace(model, scale=np.eye(3)))[..., CHANNELS, CHANNELS]
    kernel = moments.kernel[..., CHANNELS, CHANNELS]
    matrix = np.empty((3, 2, 2))
    matrix[:, 0, 0] = (shape**2 * moments.kernel_kernel[..., CHANNELS, CHANNELS, CHANNELS]).sum(
        (0, 1)
    )
    matrix[:, 0, 1] = matrix[:, 1, 0] = (shape * kernel).sum((0, 1))
    matrix[:, 1, 1] = problem.cell_weight.sum((0, 1))
    right = np.stack(
        [
            (shape * moments.kernel_target[..., CHANNELS, CHANNELS]).sum((0, 1)),
            problem.cell_target.sum((0, 1)),
        ],
        -1,
    )
    x = solve_nonnegative(matrix, right)
    # a scale of exactly zero would also zero D in the next update; the floor is the channel's own,
    # for in the gauge of maximum 1 the scales of channels can differ by many orders of magnitude
    scale = np.maximum(x[:, 0], SCALE_FLOOR * np.diag(model.scale))
    return replace(model, scale=np.diag(scale), diffuse=x[:, 1])


def channel_errors(problem: Problem, model: FactorModel) -> np.ndarray:
    """Weighted squared error (3,) of each channel, less a constant."""
    moments = problem.moments(problem.kernels(model.masking))
    a = amplitudes(model)[..., CHANNELS, CHANNELS]
    d = model.diffuse
    kernel = moments.kernel[..., CHANNELS, CHANNELS]
    target = moments.kernel_target[..., CHANNELS, CHANNELS]
    quadratic = a * a * moments.kernel_kernel[..., CHANNELS, CHANNELS, CHANNELS]
    constant = d * d * problem.cell_weight - 2 * d * problem.cell_target
    return (quadratic - 2 * a * (target - d * kernel) + constant).sum((0, 1))


def update_masking_bagher2016(
    problem: Problem, kernels: np.ndarray, model: FactorModel, channel: int
) -> FactorModel:
    """G of one channel as Bagher et al. 2016 find it; see the module's description.

    kernels : (3, 8100, n_phi) of the present model
    """
    square, right = masking_normal_equations(problem, kernels, model, channel)
    basis, present = problem.basis, model.masking[channel]

    def objective(control: np.ndarray) -> float:
        u = basis @ control
        return (u * u) @ square @ (u * u) / 2 - u @ right @ u

    def solved(other: np.ndarray) -> np.ndarray:
        """G of one direction, the u = G / cos of the other direction held."""
        weight = square @ (other * other)
        normal = basis.T @ (weight[:, None] * basis)
        normal[np.diag_indices_from(normal)] += 1e-9 * np.diag(normal).max()
        return np.maximum(np.linalg.solve(normal, basis.T @ (right @ other)), 0)

    of_i = solved(basis @ present)
    of_o = solved(basis @ of_i)
    proposed = shared.gaussian_filtered((of_i + of_o)[None] / 2, SMOOTHING_SIGMA)[0]
    if objective(proposed) > objective(present):

        def between(share: float) -> np.ndarray:
            return present + share * (proposed - present)

        share = golden_section_search(lambda t: objective(between(t)), 0, 1)
        if objective(between(share)) >= objective(present):
            return model
        proposed = between(share)
    masking = model.masking.copy()
    masking[channel] = proposed
    return replace(model, masking=masking)


def _alternate_and_step(
    problem: Problem,
    model: FactorModel,
    sweeps: int,
    joint_steps: int,
    appearance: AppearanceError | None = None,
) -> FactorModel:
    for _ in range(sweeps):
        model = sweep(problem, model)
    for stepped, _ in islice(joint.refine(problem, model, appearance=appearance), joint_steps):
        model = stepped
    return model


def _alternate(
    problem: Problem,
    model: FactorModel,
    sweeps: int,
    joint_steps: int,
    _appearance: AppearanceError | None = None,
) -> FactorModel:
    for _ in range(sweeps + SWEEPS_PER_JOINT_STEP * joint_steps):
        model = sweep(problem, model, update_masking_bagher2016)
    return model


def _best_of_each_channel(problem: Problem, models: list[FactorModel]) -> FactorModel:
    """The channels have nothing in common, so each can take the start that suits it best."""
    errors = np.stack([channel_errors(problem, model) for model in models])
    chosen = [(models[number], c) for c, number in enumerate(errors.argmin(0))]
    return FactorModel(
        diffuse=np.array([model.diffuse[c] for model, c in chosen]),
        scale=np.diag([model.scale[c, c] for model, c in chosen]),
        ndf=np.stack([model.ndf[c] for model, c in chosen]),
        masking=np.stack([model.masking[c] for model, c in chosen]),
        fresnel=np.stack([model.fresnel[c] for model, c in chosen]),
    )


def _one_lobe(problem: Problem, start: FactorModel) -> FactorModel:
    """That lobe of a start for all channels with which a first sweep gets furthest."""
    candidates = [
        sweep(
            problem,
            replace(
                start,
                scale=np.eye(3),
                ndf=np.repeat(start.ndf[lobe : lobe + 1], 3, axis=0),
                masking=np.repeat(start.masking[lobe : lobe + 1], 3, axis=0),
            ),
        )
        for lobe in range(start.n_lobes)
    ]
    return min(candidates, key=problem.objective_of)
