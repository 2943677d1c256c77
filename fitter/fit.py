# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the factor model to a measurement.

Three stages, each on the objective of `problem`:

1. explore: from every start, some sweeps of alternating weighted least squares (the paper's
   method) and a few joint steps, on a fifth of the phi_d samples;
2. refine: the best of them continues, joint steps with a sweep in between (which revives numbers
   that are zero and re-solves what is linear), on the same samples;
3. polish: on all samples with finer angle bins, then the Gaussian filter over G that the paper
   uses for specular materials (section 3.3), as strong as it can be without the stage as a whole
   raising the objective.

Within a stage the objective never rises. Nothing depends on time or on unseeded randomness: the
same measurement gives the same model.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from . import joint
from .measurement import Measurement
from .model import FactorModel
from .problem import Problem
from .starts import SPECULAR_WIDTH, STARTS, highlight_width
from .updates import (
    update_diffuse_and_scale,
    update_fresnel,
    update_masking,
    update_ndf,
)
from .weights import DEFAULT_WEIGHT

EXPLORE_SWEEPS = 12
EXPLORE_JOINT_STEPS = 5
REFINE_ROUNDS = 4
REFINE_JOINT_STEPS = 8
POLISH_JOINT_STEPS = 3

# Neighbouring phi_d bins that share a sample before the polish, and angle bins of each stage.
COARSE_PHI_GROUP = 5
COARSE_ANGLES = 360
POLISH_ANGLES = 720

# A round that gains less than this share of the objective is the last of its stage.
CONVERGED = 1e-3

# Gaussian filter over G, in control points (1 degree): 0.5-0.8 costs next to nothing in picture
# and objective, 1.2 harms mirror-like materials.
SMOOTHING_SIGMA = 0.7
SMOOTHING_SHARES = (1.0, 0.5, 0.25, 0.125)


@dataclass(frozen=True)
class FitStep:
    """State after one step of a fit.

    stage : "explore 1" ..., "refine", "polish"; the objective is comparable within a stage
    objective : E of eq. 2 relative to sum w rho^2
    model : the model now, in the fixed gauge
    progress : 0..1 of the expected work
    """

    stage: str
    objective: float
    model: FactorModel
    progress: float


@dataclass(frozen=True)
class FitResult:
    """A finished fit: the model, lobes sorted from narrow to wide, and how it came about."""

    model: FactorModel
    objective: float
    iterations: int
    weight: str


def fit(measurement: Measurement, *, weight: str = DEFAULT_WEIGHT) -> FitResult:
    """Run `fit_steps` to the end."""
    steps = list(fit_steps(measurement, weight=weight))
    return result_of(steps[-1], len(steps), weight)


def result_of(last: FitStep, iterations: int, weight: str) -> FitResult:
    """Result of a fit from its last step."""
    return FitResult(last.model.sorted_by_width(), last.objective, iterations, weight)


def fit_steps(measurement: Measurement, *, weight: str = DEFAULT_WEIGHT) -> Iterator[FitStep]:
    """Yield the state after every step, so that a caller can show progress or stop.

    weight : a name in weights.WEIGHTS
    """
    explore_count = len(STARTS) * (EXPLORE_SWEEPS + EXPLORE_JOINT_STEPS)
    refine_count = REFINE_ROUNDS * (REFINE_JOINT_STEPS + 1)
    # a polish step sees five times the samples, and takes about three times as long
    polish_count = 3 * (POLISH_JOINT_STEPS + 1)
    total = explore_count + refine_count + polish_count

    coarse = Problem(measurement, weight=weight, phi_group=COARSE_PHI_GROUP, n_angles=COARSE_ANGLES)
    explored: list[FitStep] = []
    for number, start in enumerate(STARTS):
        before = number * (EXPLORE_SWEEPS + EXPLORE_JOINT_STEPS)
        for i, (model, objective) in enumerate(_explore(coarse, start(coarse))):
            step = FitStep(f"explore {number + 1}", objective, model, (before + i) / total)
            yield step
        explored.append(step)

    model = min(explored, key=lambda step: step.objective).model
    for i, (refined, objective) in enumerate(_refine(coarse, model)):
        model = refined
        yield FitStep("refine", objective, model, (explore_count + i) / total)

    fine = Problem(measurement, weight=weight, n_angles=POLISH_ANGLES)
    for i, (polished, objective) in enumerate(_polish(fine, model)):
        done = explore_count + refine_count + 3 * (i + 1)
        yield FitStep("polish", objective, polished, min(done / total, 1))


def sweep(problem: Problem, model: FactorModel, *, hold_lobes: bool = False) -> FactorModel:
    """One round of alternating updates: D, F, then d and s, then each G.

    hold_lobes : leave D and s alone. The first sweep from a start must: solving for them while F
        and G are still guesses forgets the start and may kill a lobe for good.
    """
    kernels = problem.kernels(model.masking)
    moments = problem.moments(kernels)
    for _ in range(2):
        if not hold_lobes:
            model = update_diffuse_and_scale(problem, moments, model)
            model = update_ndf(problem, moments, model)
        model = update_fresnel(problem, moments, model)
    model = update_diffuse_and_scale(problem, moments, model)
    for lobe in range(model.n_lobes):
        model = update_masking(problem, kernels, model, lobe)
        kernels[lobe] = problem.kernels(model.masking[lobe : lobe + 1])[0]
    return model.normalized()


def _explore(problem: Problem, model: FactorModel) -> Iterator[tuple[FactorModel, float]]:
    for i in range(EXPLORE_SWEEPS):
        model = sweep(problem, model, hold_lobes=i == 0)
        yield model, problem.objective_of(model)
    yield from islice(joint.refine(problem, model), EXPLORE_JOINT_STEPS)


def _refine(problem: Problem, model: FactorModel) -> Iterator[tuple[FactorModel, float]]:
    objective = problem.objective_of(model)
    for _ in range(REFINE_ROUNDS):
        before = objective
        for refined, value in islice(joint.refine(problem, model), REFINE_JOINT_STEPS):
            model = refined
            yield model, value
        model = sweep(problem, model)
        objective = problem.objective_of(model)
        yield model, objective
        if before - objective < CONVERGED * before:
            return


def _polish(problem: Problem, model: FactorModel) -> Iterator[tuple[FactorModel, float]]:
    start = problem.objective_of(model)
    yield model, start
    steps = [(model, start), *islice(joint.refine(problem, model), POLISH_JOINT_STEPS)]
    model, objective = steps[-1]
    if highlight_width(problem) < SPECULAR_WIDTH:
        model, objective = _smoothed(problem, model, objective, bound=start)
    yield model, objective


def _smoothed(
    problem: Problem, model: FactorModel, objective: float, bound: float
) -> tuple[FactorModel, float]:
    """Filter G as much as the bound on the objective allows, the linear factors re-solved."""
    smooth = gaussian_filtered(model.masking, SMOOTHING_SIGMA)
    for share in SMOOTHING_SHARES:
        trial = replace(model, masking=model.masking + share * (smooth - model.masking))
        moments = problem.moments(problem.kernels(trial.masking))
        for update in (update_ndf, update_fresnel, update_diffuse_and_scale):
            trial = update(problem, moments, trial)
        value = problem.objective(trial, moments)
        if value <= bound:
            return trial.normalized(), value
    return model, objective


def gaussian_filtered(curves: np.ndarray, sigma: float) -> np.ndarray:
    """Rows (k, n) filtered with a Gaussian of `sigma` nodes, continued as the spline is.

    Mirrored at the left end, linear at the right, as in `splines`; the result is not negative.
    """
    reach = int(np.ceil(4 * sigma))
    offsets = np.arange(-reach, reach + 1)
    kernel = np.exp(-0.5 * (offsets / sigma) ** 2)
    kernel /= kernel.sum()
    left = curves[:, reach:0:-1]
    right = 2 * curves[:, -1:] - curves[:, -2 : -2 - reach : -1]
    padded = np.concatenate([left, curves, right], axis=1)
    windows = np.lib.stride_tricks.sliding_window_view(padded, kernel.size, axis=1)
    return np.maximum(windows @ kernel, 0)
