# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the anisotropic factor model to a measurement.

As `fit`, in two stages, both on all samples: every start gets some sweeps of alternating weighted
least squares and a few joint steps, and the best of them continues with joint steps. Sweeps never
raise E, joint steps never raise what they minimise: E e^disorder, see `prior`. The first joint
steps of a draft see half of the azimuths (`coarse`). Where the result would reflect more light than
there is, its G is lowered (`albedo`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..anisotropic_measurement import AnisotropicMeasurement
from ..fitting import joint, prior
from ..fitting.fit import Explored, FitStep, best_of_starts, until_converged
from ..fitting.quality import ANISOTROPIC_QUALITIES, DEFAULT_QUALITY
from ..fitting.weights import DEFAULT_WEIGHT
from ..models.anisotropic_model import AnisotropicModel
from .albedo import within_energy
from .coarse import STEP, CoarseModel
from .joint import normal_equations
from .problem import AnisotropicProblem
from .starts import STARTS
from .updates import sweep


def fit_steps(
    measurement: AnisotropicMeasurement,
    *,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    prior_strength: float = prior.DEFAULT_STRENGTH,
) -> Iterator[FitStep]:
    """Yield the state after every step; arguments as for fit.fit_steps."""
    work = ANISOTROPIC_QUALITIES[quality]
    total = work.all_explore_steps + work.refine_steps
    problem = AnisotropicProblem(measurement, weight=weight)
    coarse = AnisotropicProblem(measurement, weight=weight, step=STEP) if work.coarse else None

    def explore(start: Callable[[AnisotropicProblem], AnisotropicModel]) -> Explored:
        return _explore(problem, coarse, start(problem), work.sweeps, prior_strength)

    model = yield from best_of_starts(STARTS, explore, work, total)
    steps = _joint_steps(problem, model, prior_strength)
    for i, (refined, objective) in enumerate(until_converged(steps, work.refine_steps)):
        model = refined
        progress = (work.all_explore_steps + i + 1) / total
        yield FitStep("refine", objective, model, progress, prior_strength)

    limited = within_energy(model)
    if limited is not model:
        objective = joint.objective_of(problem, limited, prior_strength)
        yield FitStep("limit", objective, limited, 1.0, prior_strength)


def _explore(
    problem: AnisotropicProblem,
    coarse: AnisotropicProblem | None,
    model: AnisotropicModel,
    sweeps: int,
    strength: float,
) -> Explored:
    for i in range(sweeps):
        model = sweep(problem, model, hold_lobes=i == 0)
        yield "sweep", model, joint.objective_of(problem, model, strength), strength
    if coarse:
        for stepped, objective in _joint_steps(coarse, CoarseModel.of(model), strength):
            yield "explore", stepped.refined(), objective, strength
        return
    for stepped, objective in _joint_steps(problem, model, strength):
        yield "explore", stepped, objective, strength


def _joint_steps(
    problem: AnisotropicProblem, model: AnisotropicModel, strength: float
) -> Iterator[tuple[AnisotropicModel, float]]:
    return joint.refine(problem, model, strength, equations=normal_equations)
