# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the factor model to a measurement.

Four stages, each on the objective of `problem` and the preference of `prior`:

1. explore: from every start, some sweeps of alternating weighted least squares (the paper's
   method), each factor put in order after its update (`order`), then a few joint steps, on a part
   of the phi_d samples; the most promising get some more;
2. refine: the best of those continues with joint steps on the same samples;
3. appearance: joint steps on the same samples and on what the data looks like under lights
   (`appearance`);
4. polish: the same on all samples with finer angle bins. Where the result would reflect more light
   than there is, its G is lowered (`limits`), and F where it is far brighter at the horizon than
   any of the data (`peak`).

Without the prior (strength 0) the sweeps leave the factors as they come, refining has sweeps
between the joint steps, and the polish ends with the Gaussian filter over G that the paper uses for
specular materials (section 3.3), as strong as it can be without the stage as a whole raising the
objective.

What the joint steps minimise never rises within a stage; nor do sweeps raise it, unless they put
factors in order. Nothing depends on time or on unseeded randomness: the same measurement gives the
same model. How much work the stages do is a `quality`.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ..measurement import Measurement
from ..models.factors import AnyFactors, Factors
from ..models.model import FactorModel
from . import joint, order, prior
from .appearance import AppearanceError
from .limits import within_energy
from .peak import within_peak
from .problem import Problem
from .quality import DEFAULT_QUALITY, QUALITIES, Quality, Work
from .starts import SPECULAR_WIDTH, STARTS, highlight_width
from .updates import update_diffuse_and_scale, update_fresnel, update_masking, update_ndf
from .weights import DEFAULT_WEIGHT

# Without the prior: joint steps between two sweeps of the refinement.
REFINE_JOINT_STEPS = 8

# A round of joint steps that gains less than this share of the objective is the last of its stage.
CONVERGED = 3e-4
ROUND = 4

# Gaussian filter over G, in control points (1 degree): 0.5-0.8 costs next to nothing in picture
# and objective, 1.2 harms mirror-like materials.
SMOOTHING_SIGMA = 0.7
SMOOTHING_SHARES = (1.0, 0.5, 0.25, 0.125)

# The share of E that counts as reachable at least: the estimate is one.
LEAST_REACHABLE = 0.1

# How long a polish step takes, in steps of the other stages: it sees all samples.
POLISH_STEP = 4


# Stage, model, objective and its strength of the prior after each step from one start.
Explored = Iterator[tuple[str, Factors, float, float]]


@dataclass(frozen=True)
class FitStep:
    """State after one step of a fit.

    stage : "sweep 1", "explore 1" ..., "final 1" ..., "refine", "appearance", "polish", "limit";
        the objective is comparable within one
    objective : joint.objective_of, what the stage minimises
    model : the model now, in the fixed gauge
    progress : 0..1 of the expected work
    strength : of the prior in the objective
    appearance : that the objective looks at, if any
    """

    stage: str
    objective: float
    model: Factors
    progress: float
    strength: float
    appearance: AppearanceError | None = None

    @property
    def error(self) -> float:
        """E of eq. 2 relative to sum w rho^2."""
        both = self.objective / np.exp(prior.disorder(self.model, self.strength))
        seen = self.appearance.value(self.model) if self.appearance else 0
        return float(max(both - seen, 0))

    def error_and_disorder(self, strength: float) -> float:
        """What a step without appearance would have as its objective under another strength."""
        return self.error * np.exp(prior.disorder(self.model, strength))


@dataclass(frozen=True)
class FitResult:
    """A finished fit: the model, lobes sorted from narrow to wide, and how it came about.

    objective : E of eq. 2 relative to sum w rho^2
    """

    model: Factors
    objective: float
    iterations: int
    weight: str


def fit(
    measurement: Measurement,
    *,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    prior_strength: float = prior.DEFAULT_STRENGTH,
    make_problem: Callable[..., Problem] = Problem,
    make_appearance: Callable[[Measurement, int], AppearanceError] = AppearanceError.of,
) -> FitResult:
    """Run `fit_steps` to the end."""
    steps = list(
        fit_steps(
            measurement,
            weight=weight,
            quality=quality,
            prior_strength=prior_strength,
            make_problem=make_problem,
            make_appearance=make_appearance,
        )
    )
    return result_of(steps[-1], len(steps), weight)


def result_of(last: FitStep, iterations: int, weight: str) -> FitResult:
    """Result of a fit from its last step."""
    return FitResult(last.model.sorted_by_width(), last.error, iterations, weight)


def fit_steps(
    measurement: Measurement,
    *,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    prior_strength: float = prior.DEFAULT_STRENGTH,
    make_problem: Callable[..., Problem] = Problem,
    make_appearance: Callable[[Measurement, int], AppearanceError] = AppearanceError.of,
) -> Iterator[FitStep]:
    """Yield the state after every step, so that a caller can show progress or stop.

    weight : a name in weights.WEIGHTS
    quality : a name in quality.QUALITIES
    prior_strength : of `prior`; 0 fits the data alone
    make_problem, make_appearance : for experiments with variants of the model
    """
    work = QUALITIES[quality]
    polish_work = POLISH_STEP * work.polish_steps
    total = work.all_explore_steps + work.refine_steps + work.appearance_steps + polish_work
    problem = make_problem(
        measurement,
        weight=weight,
        phi_group=work.coarse_phi_group,
        n_angles=work.coarse_angles,
    )

    def explore(start: Callable[[Problem], FactorModel]) -> Explored:
        return _explore(problem, start(problem), work.sweeps, prior_strength)

    model = yield from best_of_starts(STARTS, explore, work, total)
    run = _Run(model, work.all_explore_steps, total)
    strength = felt_strength(prior_strength, problem, run.model)
    refined = _refine(problem, run.model, work, strength)
    yield from run.stage("refine", refined, work.refine_steps, strength)
    appearance = make_appearance(measurement, work.maps)
    steps = joint.refine(problem, run.model, strength, appearance)
    spare = max(work.refine_steps - run.n_steps, 0)
    run.done -= spare
    n_steps = work.appearance_steps + spare
    yield from run.stage(
        "appearance", until_converged(steps, n_steps), n_steps, strength, appearance
    )
    if work.polish_steps:
        problem = make_problem(measurement, weight=weight, n_angles=work.polish_angles)
        strength = felt_strength(prior_strength, problem, run.model)
        polished = _polish(problem, run.model, work.polish_steps, strength, appearance)
        yield from run.stage("polish", polished, polish_work, strength, appearance)
    limited = within_energy(within_peak(run.model, measurement.f_r.max()))
    if limited is not run.model:
        objective = joint.objective_of(problem, limited, strength, appearance)
        yield from run.stage("limit", iter([(limited, objective)]), 0, strength, appearance)


@dataclass
class _Run:
    """The model so far and the work done of a total; a step of the coarse stages is the unit."""

    model: FactorModel
    done: int
    total: int
    n_steps: int = 0

    def stage(
        self,
        name: str,
        steps: Iterator[tuple[FactorModel, float]],
        budget: int,
        strength: float,
        appearance: AppearanceError | None = None,
    ) -> Iterator[FitStep]:
        """Pass on the steps (model, objective) of a stage; keep the last model and their number.

        budget : work of the stage if it does not end early
        """
        unit = POLISH_STEP if name == "polish" else 1
        for i, (model, objective) in enumerate(steps):
            self.model = model
            progress = min((self.done + unit * i) / self.total, 1)
            yield FitStep(name, objective, model, progress, strength, appearance)
            self.n_steps = i + 1
        self.done += budget


def felt_strength(strength: float, problem: Problem, model: FactorModel) -> float:
    """Strength of the prior against the part of E that a model can take away.

    Noise, or data that is not reciprocal, would else make the prior stronger: a disorder of 1 has
    to buy a factor of e, and what cannot be bought must not be counted.
    """
    reachable = 1 - problem.unreachable / max(problem.objective_of(model), np.finfo(float).tiny)
    # where E is rounding alone, so is the part of it that is out of reach, of either sign
    return strength * float(np.clip(reachable, LEAST_REACHABLE, 1))


def best_of_starts(
    starts: Sequence[Callable],
    explore: Callable[[Callable], Explored],
    work: Work,
    total: int,
) -> Generator[FitStep, None, Factors]:
    """Yield the steps of every start in turn, then of the finalists; returns the best model.

    starts : of which the first are taken
    explore : sweeps and joint steps from a start, without end
    total : expected number of steps of the whole fit
    """
    done = 0
    explored = [explore(start) for start in starts[: work.starts]]
    last: dict[int, FitStep] = {}

    def go_on(number: int, n_steps: int, name: str = "") -> Iterator[FitStep]:
        nonlocal done
        for i, (stage, model, objective, strength) in enumerate(islice(explored[number], n_steps)):
            stage = f"{name or stage} {number + 1}"
            last[number] = FitStep(stage, objective, model, (done + i) / total, strength)
            yield last[number]
        done += n_steps

    def best_first() -> list[int]:
        # starts are comparable under one strength
        strength = min(step.strength for step in last.values())
        return sorted(last, key=lambda n: last[n].error_and_disorder(strength))

    for number in range(work.starts):
        yield from go_on(number, work.sweeps + work.explore_steps)
    for number in best_first()[: work.finalists]:
        yield from go_on(number, work.final_steps, "final")
    return last[best_first()[0]].model


def sweep(
    problem: Problem, model: FactorModel, *, hold_lobes: bool = False, in_order: bool = False
) -> FactorModel:
    """One round of alternating updates: D, F, then d and s, then each G.

    hold_lobes : leave D and s alone. The first sweep from a start must: solving for them while F
        and G are still guesses forgets the start and may kill a lobe for good.
    in_order : put each factor in order after its update
    """
    ordered = _in_order if in_order else _as_it_is
    kernels = problem.kernels(model.masking)
    moments = problem.moments(kernels)
    for _ in range(2):
        if not hold_lobes:
            model = update_diffuse_and_scale(problem, moments, model)
            model = ordered(order.order_ndf, update_ndf(problem, moments, model), model)
        model = ordered(order.order_fresnel, update_fresnel(problem, moments, model), model)
    model = update_diffuse_and_scale(problem, moments, model)
    for lobe in range(model.n_lobes):
        updated = update_masking(problem, kernels, model, lobe)
        model = ordered(order.order_masking, updated, model)
        kernels[lobe] = problem.kernels(model.masking[lobe : lobe + 1])[0]
    return model.normalized()


def _as_it_is(_order: Callable, updated: FactorModel, _before: FactorModel) -> FactorModel:
    return updated


def _in_order(
    put_in_order: Callable[[FactorModel], FactorModel], updated: FactorModel, before: FactorModel
) -> FactorModel:
    """The updated model in order; curves that the update has set to zero stay as they were."""

    def revived(name: str) -> np.ndarray:
        new = getattr(updated, name)
        return np.where(new.any(axis=1, keepdims=True), new, getattr(before, name))

    return put_in_order(
        replace(updated, **{name: revived(name) for name in ("ndf", "masking", "fresnel")})
    )


def _explore(problem: Problem, model: FactorModel, sweeps: int, strength: float) -> Explored:
    for i in range(sweeps):
        model = sweep(problem, model, hold_lobes=i == 0, in_order=strength > 0)
        yield "sweep", model, joint.objective_of(problem, model, strength), strength
    felt = felt_strength(strength, problem, model)
    for stepped, objective in joint.refine(problem, model, felt):
        yield "explore", stepped, objective, felt


def _refine(
    problem: Problem, model: FactorModel, work: Quality, strength: float
) -> Iterator[tuple[FactorModel, float]]:
    if strength > 0:
        yield from until_converged(joint.refine(problem, model, strength), work.refine_steps)
        return
    objective = problem.objective_of(model)
    for _ in range(work.refine_steps // REFINE_JOINT_STEPS):
        before = objective
        for refined, value in islice(joint.refine(problem, model, 0), REFINE_JOINT_STEPS):
            model = refined
            yield model, value
        model = sweep(problem, model)
        objective = joint.objective_of(problem, model, 0)
        yield model, objective
        if before - objective <= CONVERGED * before:
            return


def until_converged(
    steps: Iterator[tuple[AnyFactors, float]], n_steps: int
) -> Iterator[tuple[AnyFactors, float]]:
    """Joint steps, n_steps at most, until a round of them gains next to nothing."""
    objectives: list[float] = []
    for refined, objective in islice(steps, n_steps):
        yield refined, objective
        objectives.append(objective)
        if len(objectives) > ROUND and objective > (1 - CONVERGED) * objectives[-1 - ROUND]:
            return


def _polish(
    problem: Problem, model: FactorModel, n_steps: int, strength: float, appearance: AppearanceError
) -> Iterator[tuple[FactorModel, float]]:
    start = model
    objective = joint.objective_of(problem, model, strength, appearance)
    yield model, objective
    steps = joint.refine(problem, model, strength, appearance)
    for polished, value in until_converged(steps, n_steps):
        model, objective = polished, value
        if strength > 0:
            yield model, objective
    if strength == 0:
        if highlight_width(problem) < SPECULAR_WIDTH:
            # the error of appearance that the steps have taken away is no room for the filter
            bound = max(objective, problem.objective_of(start))
            model, objective = _smoothed(problem, model, objective, bound, appearance)
        yield model, objective


def _smoothed(
    problem: Problem,
    model: FactorModel,
    objective: float,
    bound: float,
    appearance: AppearanceError,
) -> tuple[FactorModel, float]:
    """Filter G as much as the bound on the objective allows, the linear factors re-solved."""
    smooth = gaussian_filtered(model.masking, SMOOTHING_SIGMA)
    for share in SMOOTHING_SHARES:
        trial = replace(model, masking=model.masking + share * (smooth - model.masking))
        moments = problem.moments(problem.kernels(trial.masking))
        for update in (update_ndf, update_fresnel, update_diffuse_and_scale):
            trial = update(problem, moments, trial)
        trial = trial.normalized()
        value = joint.objective_of(problem, trial, 0, appearance)
        if value <= bound:
            return trial, value
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
