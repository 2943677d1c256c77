# SPDX-License-Identifier: GPL-3.0-or-later
"""The nearest factors in order: F rising with theta_d, G falling with theta, D with a single peak.

The alternation starts in one of the valleys where F and G trade off (see `prior`). Putting each
factor in order after its update keeps it among those that a person can read; the joint steps then
find the way from there, and may leave the order where the data asks for it.

Pool adjacent violators (Ayer et al. 1955): the least-squares monotone curve, by averaging
neighbours that are out of order.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry import theta_d_centres
from ..models.model import FactorModel

# Numbers below these shares of their curve's maximum are raised to them: joint steps move
# logarithms, and zero has none.
NDF_FLOOR = 1e-6
MASKING_FLOOR = 1e-3
FRESNEL_FLOOR = 1e-3


def nondecreasing(values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """The nondecreasing curve (n,) that is nearest to values (n,) in weighted least squares."""
    weights = np.ones_like(values) if weights is None else weights
    blocks: list[list[float]] = []  # mean, weight, count
    for value, weight in zip(values.tolist(), weights.tolist(), strict=True):
        blocks.append([value, weight, 1])
        while len(blocks) > 1 and blocks[-2][0] > blocks[-1][0]:
            last, block = blocks.pop(), blocks[-1]
            total = block[1] + last[1]
            block[0] += (last[0] - block[0]) * last[1] / total
            block[1], block[2] = total, block[2] + last[2]
    return np.repeat([mean for mean, _, _ in blocks], [int(count) for _, _, count in blocks])


def single_peaked(values: np.ndarray) -> np.ndarray:
    """Values (n,) made nondecreasing up to their maximum and nonincreasing past it."""
    peak = int(values.argmax())
    rising, falling = values[: peak + 1], values[peak:][::-1]
    return np.concatenate([nondecreasing(rising)[:-1], nondecreasing(falling)[::-1]])


def order_fresnel(model: FactorModel) -> FactorModel:
    """F rising, weighted by the number of directions at each theta_d."""
    weights = np.sin(2 * theta_d_centres())
    fresnel = np.stack([nondecreasing(row, weights) for row in model.fresnel])
    return replace(model, fresnel=_floored(fresnel, FRESNEL_FLOOR))


def order_masking(model: FactorModel) -> FactorModel:
    """G falling, and zero at 90 degrees: else G / cos theta, and f with it, has no bound there.

    No bin centre is there, so the data does not say it.
    """
    masking = np.stack([nondecreasing(row[::-1])[::-1] for row in model.masking])
    masking = _floored(masking, MASKING_FLOOR)
    masking[:, -1] = 0
    return replace(model, masking=masking)


def order_ndf(model: FactorModel) -> FactorModel:
    """D with a single peak, nearest in the logarithm: it spans decades."""
    floored = _floored(model.ndf, NDF_FLOOR)
    return replace(model, ndf=np.stack([np.exp(single_peaked(row)) for row in np.log(floored)]))


def _floored(curves: np.ndarray, floor: float) -> np.ndarray:
    return np.maximum(curves, floor * curves.max(1, keepdims=True))
