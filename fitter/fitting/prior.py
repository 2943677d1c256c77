# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fit prefers where the data leaves a choice: factors that a person can read and edit.

Near the mirror direction theta_i = theta_o = theta_d. For a sharp lobe F and 1 / G^2 are therefore
nearly interchangeable, the data hardly says which of them rises, and a free fit ends with an F
that vanishes at grazing under a G that explodes there. The joint steps minimise, instead of E,

    log E + disorder

so that a disorder of 1 has to buy a factor of e in E, whatever the material. Only the part of E
that a model can take away counts: `fit.felt_strength`. Disorder is the sum
over the curves, each with maximum 1, of

- wrong way: by how much F falls with theta_d, G rises with theta, and D moves away from a single
  peak; a curve in order has none. F and G count as they are plotted, D in decades;
- roughness: the sum of squared second differences, against staircases;
- level: squared first differences of the logarithm, so weakly that only numbers which the data
  does not see (D near 90 degrees) feel it and follow their neighbours; F, which else would drift
  along e^(k theta) without end, a little more;
- excess: squared logarithms of scales beyond those of any highlight. Factors of a lobe can run away
  from each other, a D that rises to the horizon against a G that falls to it, over ten decades for
  a few per cent of E.

The terms are means over the curves of a factor. The first two are multiplied by the strength.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from .. import polar_grid
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import Factors

# Weights of the terms of the disorder.
WRONG_WAY = {"fresnel": 1.0, "masking": 1.0, "ndf": 0.5}
ROUGHNESS = {"fresnel": 3.0, "masking": 3.0, "ndf": 1.0}
LEVEL = {"fresnel": 1e-3, "masking": 1e-5, "ndf": 1e-5}

# The same for the tables of the anisotropic model, along theta and around phi. Along theta, where
# six nodes are 15 degrees apart, no roughness: a second difference there is the shape itself. D may
# have any number of peaks, that of cloth has one for every family of threads.
ANISOTROPIC_WRONG_WAY = {"masking along": 1.0, "ratio along": 1.0}
ANISOTROPIC_ROUGHNESS = {"masking around": 1.0, "ndf around": 0.1}
# There are few angles at which the data could tell F from 1 / G^2, and far more of a drift between
# the nodes than on them: F is held a hundred times more firmly, and what is to replace it in the
# drift, G / cos theta, may not fall.
ANISOTROPIC_LEVEL = {
    "fresnel": 0.1,
    "masking along": 1e-4,
    "masking around": 1e-4,
    "ndf along": 1e-5,
    "ndf around": 1e-4,
}

# Scales up to this, 1/sr, cost nothing: those of the sharpest highlights of known data are below
# it. Beyond, EXCESS times log^2.
LARGE_SCALE = 1e7
EXCESS = 1e-3

# How much stronger the levels are without order, which else keeps F and G from drifting apart: the
# scales of steel would reach 1e13, more than a parameter file holds.
FREE_LEVEL = 10

# Below this share of its maximum the shape of D no longer matters.
NDF_FLOOR = 1e-5

# Steps the wrong way below this size count quadratically: the sum of sizes has no derivative at 0.
SOFTENING = 1e-3
RATIO_SOFTENING = 0.02  # of log(G / cos theta); many of its steps stay near 0

DEFAULT_STRENGTH = 0.25


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


def terms(model: Factors, strength: float) -> dict[str, Terms]:
    """Terms of the disorder of a model, by the name of the factor.

    Positions of D and G are those of model.free_numbers.
    """
    free = {
        "ndf": model.free_numbers(model.ndf),
        "fresnel": model.fresnel,
        "masking": model.free_numbers(model.masking),
    }
    if isinstance(model, AnisotropicModel):
        families = _anisotropic_families(free)
    else:
        families = _isotropic_families(free)
    found = {
        name: _joined([_terms(numbers, strength, family) for family in families[name]])
        for name, numbers in free.items()
    }
    return {**found, "scale": _excess(model.scale.ravel())}


def disorder(model: Factors, strength: float) -> float:
    """The disorder of a model, 0 for level factors."""
    return float(sum(t.cost.sum() for t in terms(model, strength).values()))


@dataclass(frozen=True)
class _Family:
    """Curves of a factor that are judged alike.

    index : (rows, n) flat positions of each curve's numbers in the factor
    curve : what takes curves to the values that are judged, and to their derivatives to log numbers
    wrong : tells which steps go the wrong way
    wrong_way, roughness, level : weights of the three terms
    softening : of the first
    closed : the curves are closed, and end with their first two numbers again
    """

    index: np.ndarray
    curve: Callable
    wrong: Callable
    wrong_way: float
    roughness: float
    level: float
    softening: float = SOFTENING
    closed: bool = False


def _isotropic_families(free: dict[str, np.ndarray]) -> dict[str, list[_Family]]:
    shapes = {
        "ndf": (_decades, _away_from_peak),
        "fresnel": (_plotted, _falling),
        "masking": (_plotted, _rising),
    }
    return {
        name: [
            _Family(
                np.arange(free[name].size).reshape(free[name].shape),
                *shape,
                WRONG_WAY[name],
                ROUGHNESS[name],
                LEVEL[name],
            )
        ]
        for name, shape in shapes.items()
        if name in free
    }


def _anisotropic_families(free: dict[str, np.ndarray]) -> dict[str, list[_Family]]:
    n_lobes, size = free["ndf"].shape
    n_phi = (size - 1) // (polar_grid.N_THETA - 1)
    tables = np.arange(n_lobes * size).reshape(n_lobes, size)
    pole = np.repeat(tables[:, :1, None], n_phi, axis=2)
    full = np.concatenate([pole, tables[:, 1:].reshape(n_lobes, -1, n_phi)], axis=1)
    # around: closed, with two numbers repeated so that every second difference is there
    lines = {
        "along": full.transpose(0, 2, 1).reshape(-1, polar_grid.N_THETA),
        "around": np.concatenate([full[:, 1:], full[:, 1:, :2]], axis=2).reshape(-1, n_phi + 2),
    }

    def family(name: str, axis: str, curve: Callable, wrong: Callable) -> _Family:
        key = f"{name} {axis}"
        tables_of_weights = (ANISOTROPIC_WRONG_WAY, ANISOTROPIC_ROUGHNESS, ANISOTROPIC_LEVEL)
        weights = (w.get(key, 0.0) for w in tables_of_weights)
        return _Family(lines[axis], curve, wrong, *weights, closed=axis == "around")

    return {
        "ndf": [family("ndf", axis, _decades, _away_from_peak) for axis in lines],
        "fresnel": [
            replace(isotropic, level=ANISOTROPIC_LEVEL["fresnel"])
            for isotropic in _isotropic_families({"fresnel": free["fresnel"]})["fresnel"]
        ],
        "masking": [
            *(family("masking", axis, _plotted, _rising) for axis in lines),
            replace(
                family("ratio", "along", _log_over_cosine, _falling), softening=RATIO_SOFTENING
            ),
        ],
    }


def _joined(parts: list[Terms]) -> Terms:
    return Terms(
        *(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Terms))
    )


def _terms(numbers: np.ndarray, strength: float, family: _Family) -> Terms:
    """Terms of the curves of a family; numbers (rows, k) is the whole factor."""
    index = family.index
    values, derivative = family.curve(numbers)
    factor, v, slope = (a.ravel()[index] for a in (numbers, values, derivative))
    rows = len(index)
    # each pair of a closed curve once
    pairs = slice(0, index.shape[1] - 1 - family.closed)
    step = np.diff(v)[:, pairs]
    size = np.where(family.wrong(np.diff(v), factor)[:, pairs], np.abs(step), 0)
    # size^2 / (size + softening) ~ size. A quadratic in the step with the same derivative lies
    # above it: minimising that never overshoots.
    wrong_way = strength * family.wrong_way / rows
    softening = family.softening
    half_derivative = wrong_way * (size + 2 * softening) / (2 * (size + softening) ** 2)
    root = np.sqrt(half_derivative) * (size > 0)
    second = v[:, 2:] - 2 * v[:, 1:-1] + v[:, :-2]
    rough = np.sqrt(strength * family.roughness / rows)
    logarithm = np.log(np.maximum(factor, np.finfo(float).tiny))
    difference = np.diff(logarithm)[:, pairs]
    both = ((factor[:, 1:] > 0) & (factor[:, :-1] > 0))[:, pairs]
    weak = np.sqrt(family.level * (1 if strength > 0 else FREE_LEVEL) / rows) * both
    pair = np.stack([index[:, :-1], index[:, 1:]], -1)[:, pairs]
    triple = np.stack([index[:, :-2], index[:, 1:-1], index[:, 2:]], -1)
    parts = (
        (
            wrong_way * size**2 / (size + softening),
            pair,
            root[..., None] * np.stack([-slope[:, :-1], slope[:, 1:]], -1)[:, pairs],
            root * step,
        ),
        (
            rough**2 * second**2,
            triple,
            rough * np.stack([slope[:, :-2], -2 * slope[:, 1:-1], slope[:, 2:]], -1),
            rough * second,
        ),
        (
            weak**2 * difference**2,
            pair,
            weak[..., None] * np.array([-1.0, 1.0]),
            weak * difference,
        ),
    )
    return Terms(
        cost=np.concatenate([cost.ravel() for cost, _, _, _ in parts]),
        index=np.concatenate([_padded(index) for _, index, _, _ in parts]),
        slope=np.concatenate([_padded(slope) for _, _, slope, _ in parts]),
        value=np.concatenate([value.ravel() for _, _, _, value in parts]),
    )


def _excess(scale: np.ndarray) -> Terms:
    """Terms of scales (n,) beyond LARGE_SCALE."""
    beyond = np.log(np.maximum(scale / LARGE_SCALE, 1))
    root = np.sqrt(EXCESS) * (beyond > 0)
    return Terms(
        cost=EXCESS * beyond**2,
        index=_padded(np.arange(scale.size)[None, :, None]),
        slope=_padded(root[None, :, None]),
        value=root * beyond,
    )


def _padded(array: np.ndarray) -> np.ndarray:
    """(rows, n, 1 to 3) as (rows * n, 3), filled with zeros."""
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


def _log_over_cosine(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log(G / cos theta) of tables on the UTIA grid (lobes, 241), or of fewer azimuths."""
    beyond_pole = np.cos(polar_grid.theta_nodes()[1:])
    cosine = np.append(1.0, np.repeat(beyond_pole, (factor.shape[1] - 1) // len(beyond_pole)))
    positive = np.maximum(factor, np.finfo(float).tiny)
    return np.log(positive / cosine), np.ones_like(factor)


def _rising(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    return step > 0


def _falling(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    return step < 0


def _away_from_peak(step: np.ndarray, factor: np.ndarray) -> np.ndarray:
    past = np.arange(step.shape[1]) >= factor.argmax(1)[:, None]
    return (step > 0) == past
