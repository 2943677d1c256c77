# SPDX-License-Identifier: GPL-3.0-or-later
"""The least value of a function of one variable."""

from __future__ import annotations

from collections.abc import Callable, Sequence

INVERSE_GOLDEN_RATIO = (5**0.5 - 1) / 2


def golden_section_search(
    function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-3
) -> float:
    """Where a unimodal function is least between low and high, to within tolerance (Kiefer 1953).

    Each step keeps the golden section of the interval, so that one of the two inner points serves
    again: one evaluation a step.
    """
    width = INVERSE_GOLDEN_RATIO * (high - low)
    left, right = high - width, low + width
    at_left, at_right = function(left), function(right)
    while high - low > tolerance:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - INVERSE_GOLDEN_RATIO * (high - low)
            at_left = function(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + INVERSE_GOLDEN_RATIO * (high - low)
            at_right = function(right)
    return (low + high) / 2


def least_around_nodes(
    function: Callable[[float], float], nodes: Sequence[float], tolerance: float = 1e-3
) -> float:
    """Where a function is least, if it is unimodal between the neighbours of its least node."""
    best = min(range(len(nodes)), key=lambda index: function(nodes[index]))
    low, high = nodes[max(best - 1, 0)], nodes[min(best + 1, len(nodes) - 1)]
    return golden_section_search(function, low, high, tolerance)
