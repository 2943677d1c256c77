# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a fit starts: rough factors from which the alternation finds its valley.

The objective has many local minima and no start wins for every material, so `fit` tries several
for a short time and continues the best.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..geometry import HALF_PI, theta_h_centres
from ..models.factors import N_LOBES
from ..models.model import FactorModel
from ..models.splines import masking_nodes
from .problem import Problem

# Mean over theta_d below 30 degrees: there theta_h alone decides, grazing effects are absent.
N_NORMAL_INCIDENCE = 30

# Half width at half maximum in theta_h below which a highlight counts as specular.
SPECULAR_WIDTH = np.radians(10)


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
    start_random,
    start_fixed,
    start_narrow,
    start_random_again,
)


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
