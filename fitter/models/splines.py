# SPDX-License-Identifier: GPL-3.0-or-later
"""Catmull-Rom interpolation of the masking factor over theta (Peng et al. 2017, section 2.3).

G has 90 control points at k * 90/89 degrees, so that 0 and 90 degrees are both control points.
Beyond the ends the curve is mirrored at 0 (it is even in theta) and continued linearly at 90
degrees. Every value is a weighted sum of at most four control points.
"""

from __future__ import annotations

import numpy as np

from ..geometry import HALF_PI
from ..taps import Taps

N_MASKING = 90


def masking_nodes() -> np.ndarray:
    """Control point positions (90,), radians, 0 to pi/2 inclusive."""
    return np.linspace(0, HALF_PI, N_MASKING)


def catmull_rom_taps(theta: np.ndarray) -> Taps:
    """Interpolation of the control points at angles (n,), clamped to [0, pi/2]."""
    position = np.clip(np.asarray(theta) / HALF_PI, 0, 1) * (N_MASKING - 1)
    segment = np.minimum(position.astype(np.intp), N_MASKING - 2)
    t = position - segment
    t2, t3 = t * t, t * t * t
    before = (-t3 + 2 * t2 - t) / 2
    left = (3 * t3 - 5 * t2 + 2) / 2
    right = (-3 * t3 + 4 * t2 + t) / 2
    after = (t3 - t2) / 2
    last = segment == N_MASKING - 2
    # linear continuation: G[90] = 2 G[89] - G[88]
    left = np.where(last, left - after, left)
    right = np.where(last, right + 2 * after, right)
    after = np.where(last, 0.0, after)
    index = [np.abs(segment - 1), segment, segment + 1, np.minimum(segment + 2, N_MASKING - 1)]
    return Taps(N_MASKING, np.stack(index), np.stack([before, left, right, after]))


def evaluate(control_points: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Curve through control points (k, 90) at angles (n,): (k, n), not below 0."""
    return through(catmull_rom_taps(theta), control_points)


def through(taps: Taps, control_points: np.ndarray) -> np.ndarray:
    """The same at the angles of some taps.

    A Catmull-Rom curve can dip below its control points; a masking factor cannot be negative.
    """
    return np.maximum(taps.of(control_points), 0)
