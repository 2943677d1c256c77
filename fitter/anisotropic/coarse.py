# SPDX-License-Identifier: GPL-3.0-or-later
"""An anisotropic model with half of the azimuths: the first joint steps of a draft.

Most of a joint step is solving for all free numbers at once: 1,008 of them take a sixth of the time
that 1,737 take. The measurement is seen at these azimuths, too: at 7,381 pairs of directions.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .. import polar_grid
from ..models.anisotropic_model import AnisotropicModel

STEP = 2
N_PHI = polar_grid.N_PHI // STEP
N_FREE = 1 + (polar_grid.N_THETA - 1) * N_PHI


class CoarseModel(AnisotropicModel):
    """A model whose D and G are free at every second azimuth, and geometric means between."""

    @staticmethod
    def free_numbers(tables: np.ndarray) -> np.ndarray:
        """Numbers (lobes, 121) of a D or G (lobes, 6, 48)."""
        rows = tables[:, 1:, ::STEP].reshape(len(tables), -1)
        return np.concatenate([tables[:, 0, :1], rows], axis=1)

    @staticmethod
    def full_tables(free: np.ndarray) -> np.ndarray:
        """The tables (lobes, 6, 48) that such numbers stand for."""
        tables = np.empty((len(free), *polar_grid.GRID))
        tables[:, 0] = free[:, :1]
        rows = free[:, 1:].reshape(len(free), -1, N_PHI)
        tables[:, 1:, ::STEP] = rows
        tables[:, 1:, 1::STEP] = np.sqrt(rows * np.roll(rows, -1, axis=2))
        return tables

    @classmethod
    def of(cls, model: AnisotropicModel) -> CoarseModel:
        """What is left of a model with half of the azimuths."""
        ndf, masking = (cls.full_tables(cls.free_numbers(t)) for t in (model.ndf, model.masking))
        return cls(model.diffuse, model.scale, ndf, masking, model.fresnel)

    def refined(self) -> AnisotropicModel:
        """The same function as a model with all azimuths."""
        return AnisotropicModel(self.diffuse, self.scale, self.ndf, self.masking, self.fresnel)


@lru_cache(maxsize=1)
def spread() -> np.ndarray:
    """Derivative (241, 121) of the logarithms of all numbers of a table to those that are free."""
    logarithms = np.eye(N_FREE)
    tables = np.log(CoarseModel.full_tables(np.exp(logarithms)))
    return polar_grid.free_numbers(tables).T
