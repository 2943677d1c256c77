# SPDX-License-Identifier: GPL-3.0-or-later
"""The view directions at which base lobes are fitted, and the points of the integrals there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..quadrature import ViewQuadrature, view_quadrature


@dataclass(frozen=True)
class ViewGrid:
    """Rows of view angles times evenly spaced azimuths from 0.

    theta_o : radians, rising
    n_phi : azimuths of the viewer; 1 for materials that have no direction
    points : numbers of theta_h and phi_h for the quadrature at each view; with too few of them,
        ramps of either sign follow the points and not the lobe
    turn : over which phi_h runs: half a turn does where both halves are alike
    """

    theta_o: tuple[float, ...]
    n_phi: int
    points: tuple[int, int]
    turn: float

    @property
    def n_points(self) -> int:
        """Points of all views together, including those below the horizon."""
        return len(self.theta_o) * self.n_phi * self.points[0] * self.points[1]

    def rows(self) -> list[list[ViewQuadrature]]:
        """Quadratures at the views, azimuth by azimuth in each row.

        The points of a row turn with the viewer, so that closures that do so too are the same
        numbers, and no azimuth is fitted to points that favour it.
        """
        upright = [view_quadrature(theta, *self.points, self.turn) for theta in self.theta_o]
        azimuths = np.arange(self.n_phi) / self.n_phi * 2 * np.pi
        return [[view.turned(phi) if phi else view for phi in azimuths] for view in upright]

    def areas(self) -> np.ndarray:
        """Weight (views,) of each view: its share of a sphere's projected area, and a little."""
        theta_o = np.array(self.theta_o)
        areas = np.sin(theta_o) * np.cos(theta_o) * np.gradient(theta_o)
        return np.repeat((areas + 0.005) / self.n_phi, self.n_phi)

    def table(self, values: np.ndarray) -> np.ndarray:
        """Values (views, ...) as (rows, azimuths, ...)."""
        return values.reshape(len(self.theta_o), self.n_phi, *values.shape[1:])


def _radians(*degrees: float) -> tuple[float, ...]:
    return tuple(np.radians(degrees).tolist())


# Lobes change fastest towards grazing; the first angles are close because closures that lean away
# from the viewer must fade out where there is no direction to lean.
_ISOTROPIC_ANGLES = _radians(
    *(0.5, 2, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55),
    *(60, 63, 66, 69, 72, 75, 78, 81, 84, 86, 88, 89.5),
)
# The factors of anisotropic models are linear between multiples of 15 degrees, and what a
# view shows changes fast beyond 60 degrees.
_ANISOTROPIC_ANGLES = _radians(
    *(0.5, 8, 15, 22.5, 30, 37.5, 45, 52.5, 60, 66, 71, 75, 79, 83, 87, 89.5)
)

# Grids of the table of weights, by the kind of model.
FIT_GRIDS = {
    "isotropic": ViewGrid(_ISOTROPIC_ANGLES, 1, (96, 16), np.pi),
    "anisotropic": ViewGrid(_ANISOTROPIC_ANGLES, 24, (48, 64), 2 * np.pi),
}

# While a person drags a slider.
DRAFT_GRIDS = {
    "isotropic": FIT_GRIDS["isotropic"],
    "anisotropic": ViewGrid(_radians(0.5, 15, 30, 45, 60, 75, 85), 8, (32, 48), 2 * np.pi),
}

# Selection looks at fewer views and fewer directions; it only ranks closures.
SELECTION_GRIDS = {
    "isotropic": ViewGrid(_radians(0.5, 16, 32, 48, 60, 72, 80, 85), 1, (64, 12), np.pi),
    "anisotropic": ViewGrid(_radians(0.5, 30, 55, 75), 8, (24, 36), 2 * np.pi),
}
