# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid of directions of the UTIA database (Filip and Vavra 2014), and tables on it.

6 polar angles 0, 15, ... 75 degrees times 48 azimuths 0, 7.5, ... 352.5 degrees, counted from the
tangent (+x) towards the bitangent (+y): counter-clockwise about the normal. A table (6, 48) stands
for a function of a direction that is bilinear in theta and phi between the nodes, and periodic.

At the pole, theta = 0, the azimuth means nothing: the 48 numbers of the first row must agree, or
the function would not be continuous there. With equal numbers, the interpolated value depends on
phi only in proportion to theta, so rounding of an azimuth near the pole does no harm, nor does the
arbitrary azimuth of the pole itself.
"""

from __future__ import annotations

import numpy as np

from .geometry import HALF_PI
from .taps import Taps

N_THETA = 6
N_PHI = 48
N_NODES = N_THETA * N_PHI
GRID = (N_THETA, N_PHI)

# Directions that differ: the pole is one.
N_FREE = 1 + (N_THETA - 1) * N_PHI

THETA_STEP = np.radians(15.0)
PHI_STEP = np.radians(7.5)
LAST_THETA = (N_THETA - 1) * THETA_STEP


def theta_nodes() -> np.ndarray:
    """Polar angles of the rows (6,), radians."""
    return np.radians(15.0 * np.arange(N_THETA))


def phi_nodes() -> np.ndarray:
    """Azimuths of the columns (48,), radians."""
    return np.radians(7.5 * np.arange(N_PHI))


def directions() -> np.ndarray:
    """Unit directions of the nodes (288, 3), theta the slower; row 0 holds the pole 48 times."""
    theta, phi = (a.ravel() for a in np.meshgrid(theta_nodes(), phi_nodes(), indexing="ij"))
    return unit_vectors(theta, phi)


def unit_vectors(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Directions (n, 3) of angles (n,)."""
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)


def free_numbers(tables: np.ndarray) -> np.ndarray:
    """What is free of tables (k, 6, 48): (k, 241), the pole's number once and then the rows."""
    flat = tables.reshape(len(tables), N_NODES)
    return np.concatenate([flat[:, :1], flat[:, N_PHI:]], axis=1)


def full_tables(free: np.ndarray) -> np.ndarray:
    """Tables (k, 6, 48) of their free numbers (k, 241)."""
    return free[:, free_index()].reshape(len(free), *GRID)


def free_index() -> np.ndarray:
    """Which free number each node of a flat table has: (288,)."""
    return np.maximum(np.arange(N_NODES) - (N_PHI - 1), 0)


def solid_angles() -> np.ndarray:
    """Solid angle (288,) of the directions nearest to each node; they sum to the hemisphere.

    The pole's cap is shared by its 48 nodes, and the last row reaches down to the horizon.
    """
    edges = np.concatenate([[0.0], theta_nodes()[:-1] + THETA_STEP / 2, [HALF_PI]])
    return np.repeat(-np.diff(np.cos(edges)) * PHI_STEP, N_PHI)


def taps(theta: np.ndarray, phi: np.ndarray) -> Taps:
    """Bilinear interpolation of flat tables at angles (n,).

    Beyond the last row the weights fall linearly to zero at theta = 90 degrees; clamp theta to
    LAST_THETA for a constant continuation.
    """
    row_position = np.clip(np.asarray(theta) / THETA_STEP, 0, N_THETA)
    upper = np.minimum(row_position.astype(np.intp), N_THETA - 1)
    t = row_position - upper
    lower = np.minimum(upper + 1, N_THETA - 1)
    lower_weight = np.where(upper < N_THETA - 1, t, 0)  # the row at 90 degrees is zero

    column_position = np.asarray(phi) / PHI_STEP
    left = np.floor(column_position)
    s = column_position - left
    left = left.astype(np.intp) % N_PHI
    right = (left + 1) % N_PHI

    index = np.stack([row * N_PHI + column for row in (upper, lower) for column in (left, right)])
    weight = np.stack([r * c for r in (1 - t, lower_weight) for c in (1 - s, s)])
    return Taps(N_NODES, index, weight)


def interpolate(tables: np.ndarray, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Tables (k, 6, 48) at angles (n,): (k, n); linear to zero beyond the last row, see `taps`."""
    return taps(theta, phi).of(tables.reshape(len(tables), N_NODES))
