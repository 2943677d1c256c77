# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fit prefers where the data leaves a choice: factors that a person can read and edit.

Near the mirror direction theta_i = theta_o = theta_d. For a sharp lobe F and 1 / G^2 are therefore
nearly interchangeable, the data hardly says which of them rises, and a free fit ends with an F
that vanishes at grazing under a G that explodes there. The joint steps minimise, instead of E,

    log E + disorder

so that a disorder of 1 has to buy a factor of e in E, whatever the material. Disorder is the sum
over the curves, each with maximum 1, of

- wrong way: by how much F falls with theta_d, G rises with theta, and D moves away from a single
  peak; a curve in order has none. F and G count as they are plotted, D in decades;
- roughness: the sum of squared second differences, against staircases;
- level: squared first differences of the logarithm, so weakly that only numbers which the data
  does not see (D near 90 degrees) feel it and follow their neighbours; F, which else would drift
  along e^(k theta) without end, a little more.

The terms are means over the curves of a factor. The first two are multiplied by the strength.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .model import FactorModel

# Weights of the terms of the disorder.
WRONG_WAY = {"fresnel": 1.0, "masking": 1.0, "ndf": 0.5}
ROUGHNESS = {"fresnel": 3.0, "masking": 3.0, "ndf": 1.0}
LEVEL = {"fresnel": 1e-3, "masking": 1e-5, "ndf": 1e-5}

# How much stronger the levels are without order, which else keeps F and G from drifting apart: the
# scales of steel would reach 1e13, more than a parameter file holds.
FREE_LEVEL = 10

# Below this share of its maximum the shape of D no longer matters.
NDF_FLOOR = 1e-5

# Steps the wrong way below this size count quadratically: the sum of sizes has no derivative at 0.
SOFTENING = 1e-3

DEFAULT_STRENGTH = 0.3


@dataclass(frozen=True)
class Terms:
    """Disorder of one factor as a sum of terms, each a function of at most three neighbours.

    cost : (n,) the terms
    index : (n, 3) flat positions in the factor
    slope : (n, 3) derivative of r_k to the logarithm of the number at each position, where the
        terms are to first order r_k^2 in the value r_k
    value : (n,) r_k
    """

    cost: np.ndarray
    index: np.ndarray
    slope: np.ndarray
    value: np.ndarray


def terms(model: FactorModel, strength: float) -> dict[str, Terms]:
    """Terms of the disorder of a model, by the name of the factor."""
    return {
        "ndf": _terms("ndf", model.ndf, strength, _decades, _away_from_peak),
        "fresnel": _terms("fresnel", model.fresnel, strength, _plotted, _falling),
        "masking": _terms("masking", model.masking, strength, _plotted, _rising),
    }


def disorder(model: FactorModel, strength: float) -> float:
    """The disorder of a model, 0 for level factors."""
    return float(sum(t.cost.sum() for t in terms(model, strength).values()))


def _terms(
    name: str, factor: np.ndarray, strength: float, curve: Callable, wrong: Callable
) -> Terms:
    rows, n = factor.shape
    v, slope = curve(factor)
    step = np.diff(v)
    size = np.where(wrong(step, factor), np.abs(step), 0)
    # size^2 / (size + SOFTENING) ~ size. A quadratic in the step with the same derivative lies
    # above it: minimising that never overshoots.
    wrong_way = strength * WRONG_WAY[name] / rows
    half_derivative = wrong_way * (size + 2 * SOFTENING) / (2 * (size + SOFTENING) ** 2)
    root = np.sqrt(half_derivative) * (size > 0)
    second = v[:, 2:] - 2 * v[:, 1:-1] + v[:, :-2]
    rough = np.sqrt(strength * ROUGHNESS[name] / rows)
    logarithm = np.log(np.maximum(factor, np.finfo(float).tiny))
    both = (factor[:, 1:] > 0) & (factor[:, :-1] > 0)
    weak = np.sqrt(LEVEL[name] * (1 if strength > 0 else FREE_LEVEL) / rows) * both
    start = np.arange(rows)[:, None, None] * n
    pair = start + np.arange(n - 1)[:, None] + np.arange(2)
    triple = start + np.arange(n - 2)[:, None] + np.arange(3)
    parts = (
        (
            wrong_way * size**2 / (size + SOFTENING),
            pair,
            root[..., None] * np.stack([-slope[:, :-1], slope[:, 1:]], -1),
            root * step,
        ),
        (
            rough**2 * second**2,
            triple,
            rough * np.stack([slope[:, :-2], -2 * slope[:, 1:-1], slope[:, 2:]], -1),
            rough * second,
        ),
        (
            weak**2 * np.diff(logarithm) ** 2,
            pair,
            weak[..., None] * np.array([-1.0, 1.0]),
            weak * np.diff(logarithm),
        ),
    )
    return Terms(
        cost=np.concatenate([cost.ravel() for cost, _, _, _ in parts]),
        index=np.concatenate([_padded(index) for _, index, _, _ in parts]),
        slope=np.concatenate([_padded(slope) for _, _, slope, _ in parts]),
        value=np.concatenate([value.ravel() for _, _, _, value in parts]),
    )


def _padded(array: np.ndarray) -> np.ndarray:
    """(rows, n, 2 or 3) as (rows * n, 3), filled with zeros."""
    flat = array.reshape(-1, array.shape[-1])
    return np.pad(flat, ((0, 0), (0, 3 - flat.shape[1])))


def _plotted(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Curves with maximum 1, and their derivative to the logarithm of the numbers."""
    peak = factor.max(1, keepdims=True)
    v = factor / np.where(peak > 0, peak, 1)
    return v, v


def _decades(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    v, _ = _plotted(factor)
    return np.log10(v + NDF_FLOOR), v / (v + NDF_FLOOR) / np.log(10)


def _rising(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    return step > 0


def _falling(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    return step < 0


def _away_from_peak(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    past = np.arange(step.shape[1]) >= factor.argmax(1)[:, None]
    return (step > 0) == past
