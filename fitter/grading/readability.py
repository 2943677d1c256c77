# SPDX-License-Identifier: GPL-3.0-or-later
"""How well a person can read the factors of a fit: figures for the reports.

Curves are taken with maximum 1. A curve in order has a figure of 0; see `prior` for what makes the
fit prefer order.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..geometry import HALF_PI
from ..models.model import FactorModel
from ..models.tables import lobe_albedo

# D below this share of its maximum is not looked at.
NDF_FLOOR = 1e-4

# A curve turns where it goes back by more than this: share of its maximum, for D decades.
TURN = 0.02

# A lobe with less than this share of the specular light at every view angle is dead.
DEAD_SHARE = 1e-3


@dataclass(frozen=True)
class Readability:
    """Figures of one model; where there are several curves, of the worst.

    fresnel_fall : sum of the falls of F with theta_d, 0..; 1 is the whole height of the curve
    masking_rise : sum of the rises of G with theta
    ndf_rise : sum of the rises of D past its maximum, in decades down to NDF_FLOOR
    turns : how often curves change their direction by more than TURN, beyond the one maximum of
        a D, all curves together
    dead_lobes : lobes with less than DEAD_SHARE of the specular light at all view angles
    """

    fresnel_fall: float
    masking_rise: float
    ndf_rise: float
    turns: int
    dead_lobes: int

    def figures(self) -> dict[str, float | int]:
        """The figures by name."""
        return asdict(self)


def readability(model: FactorModel) -> Readability:
    """Figures of a model."""
    model = model.normalized()
    decades = np.log10(model.ndf + NDF_FLOOR)
    tails = [row[row.argmax() :] for row in decades]
    return Readability(
        fresnel_fall=max(wrong_way(-row) for row in model.fresnel),
        masking_rise=max(wrong_way(row) for row in model.masking),
        ndf_rise=max(map(wrong_way, tails)),
        turns=sum(map(count_turns, (*model.fresnel, *model.masking)))
        + sum(max(count_turns(row) - 1, 0) for row in decades),
        dead_lobes=count_dead_lobes(model),
    )


def wrong_way(curve: np.ndarray) -> float:
    """Sum of the rises of a curve (n,) that should fall."""
    return float(np.maximum(np.diff(curve), 0).sum())


def count_turns(curve: np.ndarray, size: float = TURN) -> int:
    """Changes of direction of a curve (n,), each move larger than `size`; a zigzag filter."""
    turns, direction = 0, 0
    low = high = float(curve[0])
    for value in map(float, curve[1:]):
        low, high = min(low, value), max(high, value)
        if direction >= 0 and value < high - size:
            turns += direction > 0
            direction, low, high = -1, value, value
        elif direction <= 0 and value > low + size:
            turns += direction < 0
            direction, low, high = 1, value, value
        elif direction > 0:
            low = value
        elif direction < 0:
            high = value
    return turns


def count_dead_lobes(model: FactorModel) -> int:
    """Lobes that reflect next to nothing of the specular light from any view angle."""
    albedo = lobe_albedo(model, np.linspace(0, 0.9, 7) * HALF_PI, n_phi=24, n_per_bin=2).sum(-1)
    share = albedo / np.maximum(albedo.sum(1, keepdims=True), np.finfo(float).tiny)
    return int((share.max(0) < DEAD_SHARE).sum())
