# SPDX-License-Identifier: GPL-3.0-or-later
"""A measured BRDF in memory, whatever file it came from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import merl_bin_index


@dataclass(frozen=True)
class Source:
    """Where a measurement came from.

    file_name : name without folders; text from a stranger, to be shown and stored only
    format : "merl" or "rgl"
    sha256 : of the file's bytes, hexadecimal
    """

    file_name: str
    format: str
    sha256: str


@dataclass(frozen=True)
class BinReport:
    """How many bins of a file could not be used, and why; a bin counts once.

    clamped : usable bins of a colour out of gamut, whose negative channels were set to 0
    """

    total: int
    below_horizon: int
    negative: int
    non_finite: int
    clamped: int = 0

    @property
    def usable(self) -> int:
        """Bins that hold a measurement."""
        return self.total - self.below_horizon - self.negative - self.non_finite


@dataclass(frozen=True)
class Measurement:
    """An isotropic BRDF on the MERL grid.

    f_r : (90, 90, 180, 3), 1/sr, linear RGB; 0 where not valid
    valid : (90, 90, 180) mask of the bins that hold a measurement
    """

    f_r: np.ndarray
    valid: np.ndarray
    source: Source
    report: BinReport

    def lookup(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """f_r (n, 3) of the bins that hold the unit directions (n, 3); 0 where not valid."""
        return self.f_r[merl_bin_index(wi, wo)]

    def lookup_valid(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Mask (n,): whether the bins that hold the unit directions (n, 3) were measured."""
        return self.valid[merl_bin_index(wi, wo)]
