# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors of a model as curves that a person bends, and back.

A curve is drawn in the unit square and looked at in 90 places, those of its factor's nodes:

- D over the square-root axis of theta_h, in logarithm: height 1 is the factor's maximum, height 0
  is DECADES powers of ten below;
- G over theta, F over theta_d, both linear.

The three channels of F are bent alone and, by a fourth curve, together.

The curve is a picture of the factor, with a few handles, and never as exact. What an edit does to
the factor is therefore the *ratio* of the curve now to the curve as it was drawn at first: where
the two agree, the factor's numbers stay as they are, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np

from .factors import N_LOBES
from .geometry import N_THETA_D, N_THETA_H
from .model import FactorModel
from .splines import N_MASKING

DECADES = 6.0
MOST_HANDLES = 16

# Handles are added until the curve is nowhere further from its factor than this.
TOLERANCE = 0.004

# Smallest height that a linear curve is divided by, and that a factor of 0 counts as where it is
# raised.
FLOOR = 1e-3

# Heights from a program may be anything; those of a widget are within 0 and 1.
LARGEST_HEIGHT = 10.0

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


# Every curve has a name, by which nodes, files and the interface know it.
NDF_CURVES = tuple(f"Lobe {lobe + 1} D" for lobe in range(N_LOBES))
MASKING_CURVES = tuple(f"Lobe {lobe + 1} G" for lobe in range(N_LOBES))
FRESNEL_CURVES = ("F", "F Red", "F Green", "F Blue")
CURVES = NDF_CURVES + MASKING_CURVES + FRESNEL_CURVES


def positions(name: str) -> np.ndarray:
    """Places (90,) in 0..1 at which a curve is looked at."""
    if name in MASKING_CURVES:
        return np.linspace(0, 1, N_MASKING)
    count = N_THETA_H if name in NDF_CURVES else N_THETA_D
    return (np.arange(count) + 0.5) / count


@dataclass(frozen=True)
class Curves:
    """Heights of all curves of a material.

    ndf : (lobes, 90)
    masking : (lobes, 90)
    fresnel : (4, 90) all channels together, then R, G, B
    """

    ndf: np.ndarray
    masking: np.ndarray
    fresnel: np.ndarray

    @classmethod
    def from_heights(cls, heights: Mapping[str, np.ndarray]) -> Curves:
        """Curves of heights (90,) by name."""
        return cls(
            *(
                np.array([heights[name] for name in names], dtype=float)
                for names in (NDF_CURVES, MASKING_CURVES, FRESNEL_CURVES)
            )
        )

    def heights(self) -> dict[str, np.ndarray]:
        """Heights (90,) by name."""
        rows = np.concatenate([self.ndf, self.masking, self.fresnel])
        return dict(zip(CURVES, rows, strict=True))

    def equals(self, other: Curves) -> bool:
        """Whether all heights are the same."""
        return all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)
        )


def drawn(model: FactorModel) -> Curves:
    """The factors of a model as heights, each relative to its maximum."""
    ndf = _relative(model.ndf)
    fresnel = _relative(model.fresnel)
    return Curves(
        ndf=np.clip(1 + np.log10(np.maximum(ndf, 10**-DECADES)) / DECADES, 0, 1),
        masking=_relative(model.masking),
        fresnel=np.concatenate([fresnel.mean(0, keepdims=True), fresnel]),
    )


def place_handles(
    positions: np.ndarray, heights: np.ndarray, evaluate: Evaluate | None = None
) -> np.ndarray:
    """A few points (n, 2) on a curve (k,) whose interpolation stays near it: n <= MOST_HANDLES.

    Starts with both ends and adds a point where the interpolation is furthest off.

    evaluate : the interpolation, (handles (n, 2), places (k,)) to heights (k,); None is linear
    """
    evaluate = evaluate or _linear
    ends = np.interp([0, 1], positions, heights)
    points = np.column_stack([positions, heights])
    handles = np.array([[0, ends[0]], [1, ends[1]]])
    while len(handles) < MOST_HANDLES:
        error = np.abs(evaluate(handles, positions) - heights)
        error[np.isin(positions, handles[:, 0])] = 0
        worst = int(error.argmax())
        if error[worst] <= TOLERANCE:
            break
        handles = np.concatenate([handles, points[worst : worst + 1]])
        handles = handles[handles[:, 0].argsort()]
    return handles


def bend_logarithmic(factor: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Factor (..., k) on a logarithmic axis, moved as its curve (..., k) was."""
    before, after = _sane(before), _sane(after)
    least = 10**-DECADES * factor.max(-1, keepdims=True)
    moved = np.maximum(factor, least) * 10 ** (DECADES * (after - before))
    return np.where(after == before, factor, moved)


def bend_linear(factor: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Factor (..., k) on a linear axis, scaled as its curve (..., k) was."""
    before, after = np.maximum(_sane(before), 0), np.maximum(_sane(after), 0)
    least = FLOOR * factor.max(-1, keepdims=True)
    moved = np.maximum(factor, least) * (after / np.maximum(before, FLOOR))
    return np.where(after == before, factor, moved)


def _linear(handles: np.ndarray, positions: np.ndarray) -> np.ndarray:
    return np.interp(positions, handles[:, 0], handles[:, 1])


def _relative(factor: np.ndarray) -> np.ndarray:
    peak = factor.max(1, keepdims=True)
    return factor / np.where(peak > 0, peak, 1)


def _sane(heights: np.ndarray) -> np.ndarray:
    """Heights without what is not a number and within bounds that keep products finite."""
    heights = np.nan_to_num(heights, nan=0.0, posinf=LARGEST_HEIGHT, neginf=-LARGEST_HEIGHT)
    return np.clip(heights, -1, LARGEST_HEIGHT)
