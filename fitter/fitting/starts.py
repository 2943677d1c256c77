# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a fit starts: rough factors from which the alternation finds its valley.

The objective has many local minima and no start wins for every material, so `fit` tries several
for a short time and continues the best.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..geometry import HALF_PI, N_THETA_D, theta_d_centres, theta_h_centres
from ..models.factors import N_LOBES
from ..models.model import FactorModel
from ..models.splines import masking_nodes
from .problem import Problem

# Mean over theta_d below 30 degrees: there theta_h alone decides, grazing effects are absent.
N_NORMAL_INCIDENCE = 30

# Half width at half maximum in theta_h below which a highlight counts as specular.
SPECULAR_WIDTH = np.radians(10)

# start_separated: the share of cells whose values lie below the floor, rounds of updates, and the
# least D and scale of a lobe beside a maximum of 1.
FLOOR_QUANTILE = 0.02
SEPARATION_ROUNDS = 200
LEAST = 1e-9


def highlight_profile(problem: Problem) -> np.ndarray:
    """Weighted mean of the data over theta_d < 30 degrees and channels, minus its floor: (90,)."""
    target = problem.cell_target[:, :N_NORMAL_INCIDENCE].sum((1, 2))
    weight = problem.cell_weight[:, :N_NORMAL_INCIDENCE].sum((1, 2))
    mean = target / np.where(weight > 0, weight, 1)
    return np.maximum(mean - mean[weight > 0].min(), 0)


def highlight_width(problem: Problem) -> float:
    """Half width at half maximum of the highlight, radians; pi/2 where there is none."""
    profile = highlight_profile(problem)
    peak = int(profile.argmax())
    below = np.flatnonzero(profile[peak:] < profile[peak] / 2)
    # a maximum far from the normal is sheen, not a highlight
    if peak >= len(profile) // 2 or not below.size:
        return HALF_PI
    return float(theta_h_centres()[peak + below[0]])


def start_from_width(problem: Problem) -> FactorModel:
    """GGX lobes around the width of the data's own highlight."""
    # GGX falls to a half at tan(theta_h) = 0.64 alpha
    alpha = float(np.clip(np.tan(min(highlight_width(problem), 0.5)) / 0.64, 0.01, 0.6))
    alphas = (alpha, min(3 * alpha, 0.8), 0.9) if alpha < 0.3 else (0.3 * alpha, alpha, 0.9)
    return _start(problem, np.stack([_ggx(a) for a in alphas]))


def start_fixed(problem: Problem) -> FactorModel:
    """GGX lobes of fixed widths, narrow to wide."""
    return _start(problem, np.stack([_ggx(a) for a in (0.05, 0.2, 0.6)]))


def start_separated(problem: Problem) -> FactorModel:
    """Lobes that the data itself falls into: sum_m D_m(theta_h) P_m(theta_d).

    A non-negative factorisation of the mean of the data over phi_d and channels, less its floor
    (multiplicative updates: Lee and Seung 2001; Lawrence et al. 2004 factor BRDFs that way). For a
    sharp lobe theta_i = theta_o = theta_d, so P = F G^2 / cos^2 with F level at first.
    """
    weight, target = problem.cell_weight.sum(2), problem.cell_target.sum(2)
    seen = weight > 0
    mean = target / np.where(seen, weight, 1)
    mean = np.where(seen, np.maximum(mean - np.quantile(mean[seen], FLOOR_QUANTILE), 0), 0)
    start = start_from_width(problem)
    if not mean.any():
        return start
    ndf = start.ndf.T.copy()
    profile = np.broadcast_to(mean.max(axis=0), (N_LOBES, N_THETA_D)).copy()
    for _ in range(SEPARATION_ROUNDS):
        profile *= _share(ndf.T @ (weight * mean), ndf.T @ (weight * (ndf @ profile)))
        ndf *= _share((weight * mean) @ profile.T, (weight * (ndf @ profile)) @ profile.T)
    seen_d = np.flatnonzero(seen.any(axis=0))
    theta_d = theta_d_centres()[seen_d]
    masking = np.cos(theta_d) * np.sqrt(_of_maximum_1(profile)[:, seen_d])
    scale = np.maximum(ndf.max(axis=0) * profile.max(axis=1), LEAST * mean.max())
    return replace(
        start,
        scale=np.tile(scale[:, None], 3),
        ndf=_of_maximum_1(np.maximum(_of_maximum_1(ndf.T), LEAST)),
        masking=np.stack(
            [np.maximum(np.interp(masking_nodes(), theta_d, row), 1e-3) for row in masking]
        ),
    )


def start_narrow(problem: Problem) -> FactorModel:
    """GGX lobes for mirror-like materials."""
    return _start(problem, np.stack([_ggx(a) for a in (0.02, 0.07, 0.3)]))


def start_random(problem: Problem, seed: int = 0) -> FactorModel:
    """Unrelated random D: whatever the data prefers."""
    rng = np.random.default_rng(seed)
    return _start(problem, rng.random((N_LOBES, len(theta_h_centres()))) + 0.1)


def start_random_again(problem: Problem) -> FactorModel:
    """Other random D."""
    return start_random(problem, seed=1)


STARTS: tuple[Callable[[Problem], FactorModel], ...] = (
    start_from_width,
    start_fixed,
    start_separated,
    start_narrow,
    start_random,
    start_random_again,
)


def _of_maximum_1(rows: np.ndarray) -> np.ndarray:
    return _share(rows, rows.max(axis=1, keepdims=True))


def _share(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient of non-negative numbers, 0 where nothing is divided by nothing."""
    return part / np.maximum(whole, np.finfo(float).tiny)


def _start(problem: Problem, ndf: np.ndarray) -> FactorModel:
    nodes = masking_nodes()
    return FactorModel(
        diffuse=_dark_quantile(problem),
        scale=np.ones((N_LOBES, 3)),
        ndf=ndf / ndf.max(1, keepdims=True),
        masking=np.stack([np.maximum(np.cos(nodes) ** p, 1e-3) for p in (0.6, 0.8, 1.0)]),
        fresnel=np.ones((3, 90)),
    )


def _dark_quantile(problem: Problem) -> np.ndarray:
    """A diffuse level (3,) below nearly all of the data, so that no lobe starts negative."""
    weight, target = problem.cell_weight, problem.cell_target
    return np.array(
        [
            0.8 * np.quantile((target[..., c] / np.where(w > 0, w, 1))[w > 0], 0.1)
            for c, w in enumerate(np.moveaxis(weight, -1, 0))
        ]
    )


def _ggx(alpha: float) -> np.ndarray:
    cos2 = np.cos(theta_h_centres()) ** 2
    return alpha**2 / (cos2 * (alpha**2 - 1) + 1) ** 2
