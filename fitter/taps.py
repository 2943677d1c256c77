# SPDX-License-Identifier: GPL-3.0-or-later
"""Where points lie between the numbers of a table.

Every interpolation here is a sum of a few numbers with weights that depend on the points alone.
Once computed, they serve any number of tables (Peng et al. 2017, section 2.2, "a helpful trick").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Taps:
    """Interpolation of a table of `size` numbers at n points.

    index : (taps, n) numbers that a point takes
    weight : (taps, n) how much of each
    """

    size: int
    index: np.ndarray
    weight: np.ndarray

    @classmethod
    def linear(cls, position: np.ndarray, size: int) -> Taps:
        """Linear interpolation at positions (n,) in numbers; constant beyond the ends."""
        position = np.clip(position, 0, size - 1)
        left = np.minimum(position.astype(np.intp), size - 2)
        t = position - left
        return cls(size, np.stack([left, left + 1]), np.stack([1 - t, t]))

    def of(self, tables: np.ndarray) -> np.ndarray:
        """Tables (k, size) at the points: (k, n)."""
        # term by term: a sum over a short axis is several times as slow
        (index, weight), *others = zip(self.index, self.weight, strict=True)
        total = tables.take(index, axis=1)
        total *= weight
        for index, weight in others:
            term = tables.take(index, axis=1)
            term *= weight
            total += term
        return total

    def gathered(self, values: np.ndarray) -> np.ndarray:
        """Transpose of `of` for one table: values (n,) summed into (size,)."""
        return np.bincount(self.index.ravel(), (self.weight * values).ravel(), self.size)

    def matrix(self) -> np.ndarray:
        """Matrix (n, size) that takes a table to its values at the points."""
        matrix = np.zeros((self.index.shape[1], self.size))
        np.add.at(matrix, (np.arange(len(matrix)), self.index), self.weight)
        return matrix
