# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors of a model as curves that a person bends, and back.

A curve is drawn in the unit square and looked at in 90 places, those of its factor's nodes:

- D over the square-root axis of theta_h, in logarithm: height 1 is the factor's maximum, height 0
  is DECADES powers of ten below;
- G over theta, F over theta_d, both linear.

The three channels of F are bent alone and, by a fourth curve, together. The D and G of an
anisotropic model depend on an azimuth too: polar_curves.py has theirs.

The curve is a picture of the factor, with a few handles, and never as exact. What an edit does to
the factor is therefore the *ratio* of the curve now to the curve as it was drawn at first: where
the two agree, the factor's numbers stay as they are, to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..models.factors import N_LOBES, AnyFactors, Factors
from ..models.model import FactorModel
from ..models.splines import N_MASKING

DECADES = 6.0
MOST_HANDLES = 16

# Handles are added until the curve is nowhere further from its factor than this.
TOLERANCE = 0.004

# Smallest height that a linear curve is divided by, and that a factor of 0 counts as where it is
# raised.
FLOOR = 1e-3

# Heights from a program may be anything, those of a widget are within 0 and 1; products of these
# stay finite.
LARGEST_HEIGHT = 10.0

# As many places as the factors of an isotropic model have nodes.
N_PLACES = 90

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]
Heights = Mapping[str, np.ndarray]


# Every curve has a name, by which nodes, files and the interface know it. Of an anisotropic model
# the curves over theta act on all azimuths, and those "around" over phi modulate them.
NDF_CURVES = tuple(f"Lobe {lobe + 1} D" for lobe in range(N_LOBES))
MASKING_CURVES = tuple(f"Lobe {lobe + 1} G" for lobe in range(N_LOBES))
NDF_AROUND_CURVES = tuple(f"{name} around" for name in NDF_CURVES)
MASKING_AROUND_CURVES = tuple(f"{name} around" for name in MASKING_CURVES)
FRESNEL_CURVES = ("F", "F Red", "F Green", "F Blue")
AROUND_CURVES = NDF_AROUND_CURVES + MASKING_AROUND_CURVES
CURVES = NDF_CURVES + MASKING_CURVES + AROUND_CURVES + FRESNEL_CURVES
CURVES_OF = {
    "isotropic": tuple(name for name in CURVES if name not in AROUND_CURVES),
    "anisotropic": CURVES,
}


def curves_of_lobe(lobe: int, kind: str) -> tuple[str, ...]:
    """Names of the curves of a lobe (from 0) of a kind of model."""
    families = (NDF_CURVES, NDF_AROUND_CURVES, MASKING_CURVES, MASKING_AROUND_CURVES)
    return tuple(names[lobe] for names in families if names[lobe] in CURVES_OF[kind])


def positions(name: str) -> np.ndarray:
    """Places (90,) in 0..1 at which a curve is looked at."""
    if name in MASKING_CURVES:
        return np.linspace(0, 1, N_MASKING)
    return (np.arange(N_PLACES) + 0.5) / N_PLACES


def drawn(model: FactorModel) -> Heights:
    """The factors of an isotropic model as heights (90,) by name, each relative to its maximum."""
    return (
        dict(zip(NDF_CURVES, logarithmic_height(relative(model.ndf)), strict=True))
        | dict(zip(MASKING_CURVES, relative(model.masking), strict=True))
        | drawn_fresnel(model)
    )


def drawn_fresnel(model: Factors) -> Heights:
    """F of a model of either kind as heights (90,) by name."""
    fresnel = relative(model.fresnel)
    return dict(zip(FRESNEL_CURVES, (fresnel.mean(0), *fresnel), strict=True))


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


def bend(model: FactorModel, before: Heights, after: Heights) -> FactorModel:
    """An isotropic model whose factors are moved as their curves were.

    before, after : heights (90,) of all its curves
    """
    masking = bend_linear(
        model.masking, stacked(before, MASKING_CURVES), stacked(after, MASKING_CURVES)
    )
    # not raised at the horizon: 0 there keeps f bounded
    masking[:, -1] = np.minimum(masking[:, -1], model.masking[:, -1])
    ndf = bend_logarithmic(model.ndf, stacked(before, NDF_CURVES), stacked(after, NDF_CURVES))
    return replace(bend_fresnel(model, before, after), ndf=ndf, masking=masking)


def bend_fresnel(model: AnyFactors, before: Heights, after: Heights) -> AnyFactors:
    """A model of either kind whose F is moved as its curves were."""
    common, channels = FRESNEL_CURVES[:1], FRESNEL_CURVES[1:]
    together = bend_linear(model.fresnel, stacked(before, common), stacked(after, common))
    fresnel = bend_linear(together, stacked(before, channels), stacked(after, channels))
    return replace(model, fresnel=fresnel)


def bend_logarithmic(
    factor: np.ndarray, before: np.ndarray, after: np.ndarray, decades: float = DECADES
) -> np.ndarray:
    """Factor (lobes, ...) on a logarithmic axis, moved as its curve was; any that broadcast."""
    moved = np.maximum(factor, 10**-DECADES * _peak(factor)) * 10 ** (decades * (after - before))
    return np.where(after == before, factor, moved)


def bend_linear(factor: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Factor (lobes, ...) on a linear axis, scaled as its curve was; any that broadcast."""
    before, after = np.maximum(before, 0), np.maximum(after, 0)
    moved = np.maximum(factor, FLOOR * _peak(factor)) * (after / np.maximum(before, FLOOR))
    return np.where(after == before, factor, moved)


def relative(factor: np.ndarray) -> np.ndarray:
    """Rows (rows, ...) of a factor over their maximum; a row of zeros stays."""
    peak = _peak(factor)
    return factor / np.where(peak > 0, peak, 1)


def logarithmic_height(values: np.ndarray, decades: float = DECADES) -> np.ndarray:
    """Heights 0 to 1 of values from 0 to 1, on an axis of so many powers of ten."""
    return np.clip(1 + np.log10(np.maximum(values, 10**-decades)) / decades, 0, 1)


def stacked(heights: Heights, names: Sequence[str]) -> np.ndarray:
    """Heights (names, 90) of curves, finite."""
    rows = np.array([heights[name] for name in names], dtype=float)
    rows = np.nan_to_num(rows, nan=0.0, posinf=LARGEST_HEIGHT, neginf=-LARGEST_HEIGHT)
    return np.clip(rows, -1, LARGEST_HEIGHT)


def _peak(factor: np.ndarray) -> np.ndarray:
    return factor.max(axis=tuple(range(1, factor.ndim)), keepdims=True)


def _linear(handles: np.ndarray, positions: np.ndarray) -> np.ndarray:
    return np.interp(positions, handles[:, 0], handles[:, 1])
