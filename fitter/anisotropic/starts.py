# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an anisotropic fit starts; as `starts`, on the UTIA grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .. import polar_grid
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import N_LOBES
from .problem import AnisotropicProblem

# Samples with theta_d below this show D: there are no grazing effects.
NEARLY_NORMAL = np.radians(40)


def highlight_profile(problem: AnisotropicProblem) -> np.ndarray:
    """Mean over samples near each node of D of f cos_i cos_o, minus its floor; maximum 1: (241,).

    Nodes that no such sample sees take the floor.
    """
    near = problem.theta_d < NEARLY_NORMAL
    weight = problem.half.gathered(problem.weight.sum(0) * near)
    target = problem.weighted_target.sum(0) / problem.inverse_cosines
    mean = problem.half.gathered(target * near) / np.where(weight > 0, weight, 1)
    profile = np.maximum(mean - mean[weight > 0].min(), 0)
    return profile / (profile.max() or 1)


def start_from_data(problem: AnisotropicProblem) -> AnisotropicModel:
    """The data's own highlight, sharpened, as it is and widened."""
    profile = highlight_profile(problem)
    return _start(problem, np.stack([profile**2, profile, np.sqrt(profile)]) + 1e-3)


def start_random(problem: AnisotropicProblem, seed: int = 0) -> AnisotropicModel:
    """Unrelated random D: whatever the data prefers."""
    rng = np.random.default_rng(seed)
    return _start(problem, rng.random((N_LOBES, polar_grid.N_FREE)) + 0.1)


def start_rings(problem: AnisotropicProblem) -> AnisotropicModel:
    """Isotropic lobes of fixed widths, narrow to wide."""
    theta = polar_grid.free_numbers(np.repeat(polar_grid.theta_nodes(), polar_grid.N_PHI)[None])[0]
    return _start(problem, np.stack([np.exp(-((theta / width) ** 2)) for width in (0.3, 0.6, 1.4)]))


STARTS: tuple[Callable[[AnisotropicProblem], AnisotropicModel], ...] = (
    start_from_data,
    start_random,
    start_rings,
)


def _start(problem: AnisotropicProblem, ndf: np.ndarray) -> AnisotropicModel:
    cosine = np.cos(polar_grid.theta_nodes())
    masking = np.stack([cosine**power for power in (0.6, 0.8, 1.0)])
    return AnisotropicModel(
        diffuse=_dark_quantile(problem),
        scale=np.ones((N_LOBES, 3)),
        ndf=polar_grid.full_tables(ndf / ndf.max(1, keepdims=True)),
        masking=np.repeat(masking[:, :, None], polar_grid.N_PHI, axis=2),
        fresnel=np.ones((3, 90)),
    )


def _dark_quantile(problem: AnisotropicProblem) -> np.ndarray:
    """A diffuse level (3,) below nearly all of the data, so that no lobe starts negative."""
    seen = problem.weight[0] > 0
    mean = problem.weighted_target[:, seen] / problem.weight[:, seen]
    return 0.8 * np.quantile(mean, 0.1, axis=1)
