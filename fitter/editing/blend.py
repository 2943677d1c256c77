# SPDX-License-Identifier: GPL-3.0-or-later
"""One material between two: their factors mixed in logarithm.

A mean of two BRDFs shows both highlights, one on top of the other. Mixing the logarithms of the
factors, lobe by lobe from narrow to wide, moves one highlight into the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..models.factors import AnyFactors

# What stands for 0 in a logarithm, as a share of the largest number of both materials. D spans
# decades; a colour of 0 should come in over the whole way.
NDF_FLOOR = 1e-6
FLOOR = 1e-2


def blend(first: AnyFactors, second: AnyFactors, share: float) -> AnyFactors:
    """The first material at share 0, the second at 1, exactly; the lobes matched by their width.

    Raises
    ------
    ValueError
        The models are of different kinds, or have different numbers of lobes.
    """
    if first.kind != second.kind:
        raise ValueError(f"{first.kind} and {second.kind} models cannot be matched")
    if first.n_lobes != second.n_lobes:
        raise ValueError(f"{first.n_lobes} and {second.n_lobes} lobes cannot be matched")
    if share <= 0:
        return first
    if share >= 1:
        return second
    one, two = (model.normalized().sorted_by_width() for model in (first, second))
    floors = {
        "diffuse": FLOOR,
        "scale": FLOOR,
        "ndf": NDF_FLOOR,
        "masking": FLOOR,
        "fresnel": FLOOR,
    }
    return replace(
        one,
        **{
            name: mix(getattr(one, name), getattr(two, name), share, floor)
            for name, floor in floors.items()
        },
    )


def mix(first: np.ndarray, second: np.ndarray, share: float, floor: float = FLOOR) -> np.ndarray:
    """Between two arrays of numbers >= 0, in logarithm, with a floor so that 0 has one."""
    least = floor * max(first.max(), second.max(), np.finfo(float).tiny)
    mixed = (first + least) ** (1 - share) * (second + least) ** share - least
    return np.clip(mixed, np.minimum(first, second), np.maximum(first, second))
