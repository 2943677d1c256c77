# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions on the unit square that depend on parameters, and the warps that follow them.

The tables of Dupuy and Jakob 2018 hold a function at the nodes of a regular grid over the unit
square, for nodes of further parameters such as the direction of incidence. Everything between
nodes is linear: bilinear over the square, multilinear over the parameters, constant beyond the
first and last node of a parameter.

A Warp normalises each slice to a density and turns the uniform distribution into it, first y by
the marginal, then x by the conditional distribution; the integrals of the linear interpolant are
exact. Between parameter nodes the cumulative distributions are interpolated as the densities are.
This is what Mitsuba's Marginal2D does, and has to be: the tables are indexed through it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

Corners = list[tuple[np.ndarray, np.ndarray | float]]


class SquareTable:
    """A function on the unit square, of one or several channels.

    values : (*parameters, height, width) or (*parameters, height, width, channels); at least 2 x 2
    nodes : increasing values (n,) of each parameter
    """

    def __init__(self, values: np.ndarray, nodes: Sequence[np.ndarray] = ()) -> None:
        self._nodes = [np.asarray(n, np.float64) for n in nodes]
        n_slices = int(np.prod([len(n) for n in self._nodes], dtype=np.int64))
        square = values.shape[len(self._nodes) :]
        self._values = np.asarray(values, np.float64).reshape(n_slices, *square)
        self._height, self._width = square[:2]

    def eval(self, x: np.ndarray, y: np.ndarray, *parameters: np.ndarray) -> np.ndarray:
        """Values (n,) or (n, channels) at positions x along the width and y along the height.

        parameters : (n,) each
        """
        (column, u), (row, v) = self._cell(x, y)
        result = 0
        for part, weight in self._slices(parameters):
            for j, i in product((0, 1), (0, 1)):
                share = weight * (v if j else 1 - v) * (u if i else 1 - u)
                corner = self._values[part, row + j, column + i]
                result = result + (share if corner.ndim == 1 else share[:, None]) * corner
        return result

    def _cell(
        self, x: np.ndarray, y: np.ndarray
    ) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Column and row (n,) of the patches that hold positions, each with the place inside."""
        return _split(x, self._width - 1), _split(y, self._height - 1)

    def _slices(self, parameters: Sequence[np.ndarray]) -> Corners:
        """Indices (n,) of the slices around parameters, with their weights."""
        corners: Corners = [(0, 1.0)]
        for nodes, value in zip(self._nodes, parameters, strict=True):
            if len(nodes) == 1:
                continue
            low = np.clip(np.searchsorted(nodes, value) - 1, 0, len(nodes) - 2)
            share = np.clip((value - nodes[low]) / (nodes[low + 1] - nodes[low]), 0, 1)
            corners = [
                (part * len(nodes) + low + step, weight * (share if step else 1 - share))
                for part, weight in corners
                for step in (0, 1)
            ]
        return corners


class Warp(SquareTable):
    """A density on the unit square and the warp of the uniform distribution to it.

    values : as SquareTable, of one channel, not negative
    """

    def __init__(self, values: np.ndarray, nodes: Sequence[np.ndarray] = ()) -> None:
        super().__init__(values, nodes)
        patches = (self._values[..., 1:] + self._values[..., :-1]) / 2 / (self._width - 1)
        conditional = _cumulated(patches)
        rows = conditional[..., -1]
        marginal = _cumulated((rows[:, 1:] + rows[:, :-1]) / 2 / (self._height - 1))
        total = np.where(marginal[:, -1] > 0, marginal[:, -1], 1)
        self._values /= total[:, None, None]
        self._conditional = conditional / total[:, None, None]
        self._marginal = marginal / total[:, None]

    def invert(
        self, x: np.ndarray, y: np.ndarray, *parameters: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Uniform variates (x, y), (n,) each, that `sample` would warp to these positions."""
        (column, u), (row, v) = self._cell(x, y)
        slices = self._slices(parameters)
        low, high = self._across(slices, row, column, v)
        below, whole = self._conditional_at(slices, row, column, v)
        across = below + _integral(u, low, high) / (self._width - 1)
        bottom, top = self._row_sums(slices, row)
        along = _blend(self._marginal, slices, row)
        along = along + _integral(v, bottom, top) / (self._height - 1)
        return _ratio(across, whole), along

    def sample(
        self, x: np.ndarray, y: np.ndarray, *parameters: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Positions (x, y), (n,) each, of uniform variates; the inverse of `invert`."""
        slices = self._slices(parameters)
        row = _interval(lambda k: _blend(self._marginal, slices, k), y, self._height - 1)
        bottom, top = self._row_sums(slices, row)
        rest = (y - _blend(self._marginal, slices, row)) * (self._height - 1)
        v = _inverse_integral(rest, bottom, top)

        def conditional(k: np.ndarray) -> np.ndarray:
            return self._conditional_at(slices, row, k, v)[0]

        x = x * (bottom + v * (top - bottom))
        column = _interval(conditional, x, self._width - 1)
        low, high = self._across(slices, row, column, v)
        u = _inverse_integral((x - conditional(column)) * (self._width - 1), low, high)
        return (column + u) / (self._width - 1), (row + v) / (self._height - 1)

    def _across(
        self, slices: Corners, row: np.ndarray, column: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Density at the left and right side of patches, at the place v along their height."""
        left, right = (
            (1 - v) * _blend(self._values, slices, row, column + i)
            + v * _blend(self._values, slices, row + 1, column + i)
            for i in (0, 1)
        )
        return left, right

    def _conditional_at(
        self, slices: Corners, row: np.ndarray, column: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Integral over x up to a column's left side, and over all of the width, at v."""
        bottom, top = self._row_sums(slices, row)
        below = (1 - v) * _blend(self._conditional, slices, row, column)
        below = below + v * _blend(self._conditional, slices, row + 1, column)
        return below, bottom + v * (top - bottom)

    def _row_sums(self, slices: Corners, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Integrals over x at the lower and the upper side of a row of patches."""
        bottom, top = (_blend(self._conditional, slices, row + j, -1) for j in (0, 1))
        return bottom, top


def _split(position: np.ndarray, n_patches: int) -> tuple[np.ndarray, np.ndarray]:
    scaled = np.clip(position, 0, 1) * n_patches
    index = np.minimum(scaled.astype(np.intp), n_patches - 1)
    return index, scaled - index


def _cumulated(values: np.ndarray) -> np.ndarray:
    """Sums (..., n + 1) up to each place along the last axis, from 0."""
    return np.concatenate([np.zeros_like(values[..., :1]), np.cumsum(values, -1)], -1)


def _blend(table: np.ndarray, slices: Corners, *index: np.ndarray | int) -> np.ndarray:
    return sum(weight * table[(part, *index)] for part, weight in slices)


def _integral(t: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Integral from 0 to t of the line from `low` at 0 to `high` at 1."""
    return t * (low + t * (high - low) / 2)


def _inverse_integral(area: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Inverse of _integral: t in [0, 1]."""
    # this way round nothing cancels where the line is nearly level
    divisor = low + np.sqrt(np.maximum(low * low + 2 * area * (high - low), 0))
    return np.clip(_ratio(2 * area, divisor), 0, 1)


def _interval(
    cumulative: Callable[[np.ndarray], np.ndarray], value: np.ndarray, count: int
) -> np.ndarray:
    """Largest index under `count` whose cumulative(index) is not above each value, by bisection."""
    low = np.zeros(value.shape, np.intp)
    high = np.full(value.shape, count)
    while (high - low > 1).any():
        middle = (low + high) // 2
        below = cumulative(middle) <= value
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Quotient; 0 where the denominator is not positive, as in patches where a density is zero."""
    positive = denominator > 0
    return np.where(positive, numerator / np.where(positive, denominator, 1), 0)
