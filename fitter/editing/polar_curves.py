# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of an anisotropic model: D and G over theta, for all azimuths, and over phi.

The curve over theta shows the mean over azimuths on the axes of curves.py, so that a curve can be
pasted between materials of both kinds. The curve *around*, over phi from 0 to 360 degrees, shows
how the lobe's light is spread over azimuths: D in logarithm over AROUND_DECADES, G linear.

The tables have a row every 15 degrees and a column every 7.5, the curves are looked at in 90
places. A node takes the mean of the curve near it, weighted by the tent that interpolation gives
it, so that a handle acts wherever it is moved. Around, the tents go over the seam: 0 and 360
degrees are one azimuth. The pole has no azimuth, and follows the mean of a curve around.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from .. import polar_grid
from ..geometry import HALF_PI, theta_h_centres
from ..models.anisotropic_model import AnisotropicModel
from ..polar_grid import PHI_STEP, THETA_STEP, phi_nodes, theta_nodes
from .curves import (
    MASKING_AROUND_CURVES,
    MASKING_CURVES,
    NDF_AROUND_CURVES,
    NDF_CURVES,
    Heights,
    bend_fresnel,
    bend_linear,
    bend_logarithmic,
    drawn_fresnel,
    logarithmic_height,
    positions,
    relative,
    stacked,
)

# A height of a tenth is a factor of 2.
AROUND_DECADES = 3.0


def drawn(model: AnisotropicModel) -> dict[str, np.ndarray]:
    """The factors as heights (90,) by name, each relative to its maximum."""
    ndf = _rows_at(theta_h_centres(), model.ndf.mean(-1), model.ndf[:, -1].mean(-1))
    masking = _rows_at(_masking_angles(), model.masking.mean(-1), np.zeros(model.n_lobes))
    light = np.cos(theta_nodes()) * polar_grid.solid_angles().reshape(polar_grid.GRID)[:, 0]
    ndf_around = _around(np.einsum("r,lrp->lp", light[1:], model.ndf[:, 1:]))
    masking_around = _around(model.masking[:, 1:].mean(1))
    heights = {
        NDF_CURVES: logarithmic_height(relative(ndf)),
        MASKING_CURVES: relative(masking),
        NDF_AROUND_CURVES: logarithmic_height(relative(ndf_around), AROUND_DECADES),
        MASKING_AROUND_CURVES: relative(masking_around),
    }
    by_name = {
        name: row for names, rows in heights.items() for name, row in zip(names, rows, strict=True)
    }
    return by_name | drawn_fresnel(model)


def bend(model: AnisotropicModel, before: Heights, after: Heights) -> AnisotropicModel:
    """The model whose factors are moved as their curves were.

    before, after : heights (90,) of all its curves
    """
    sides = before, after
    ndf_rows, masking_rows = _row_tents()
    ndf = bend_logarithmic(
        model.ndf, *(_on_rows(stacked(side, NDF_CURVES) @ ndf_rows.T) for side in sides)
    )
    masking = bend_linear(
        model.masking, *(_on_rows(stacked(side, MASKING_CURVES) @ masking_rows.T) for side in sides)
    )
    ndf_around, masking_around = (
        [_on_columns(stacked(side, names) @ _column_tents().T) for side in sides]
        for names in (NDF_AROUND_CURVES, MASKING_AROUND_CURVES)
    )
    return replace(
        bend_fresnel(model, before, after),
        ndf=bend_logarithmic(ndf, *ndf_around, decades=AROUND_DECADES),
        masking=bend_linear(masking, *masking_around),
    )


def _rows_at(theta: np.ndarray, rows: np.ndarray, horizon: np.ndarray) -> np.ndarray:
    """Numbers of the rows (lobes, 6), and at 90 degrees, at angles (90,): (lobes, 90)."""
    nodes = np.append(theta_nodes(), HALF_PI)
    return np.array(
        [np.interp(theta, nodes, [*row, end]) for row, end in zip(rows, horizon, strict=True)]
    )


def _around(columns: np.ndarray) -> np.ndarray:
    """Numbers of the columns (lobes, 48) at the places of a curve around: (lobes, 90)."""
    nodes = np.append(phi_nodes(), 2 * np.pi)
    return np.array([np.interp(_azimuths(), nodes, [*row, row[0]]) for row in columns])


def _on_rows(numbers: np.ndarray) -> np.ndarray:
    """Numbers (lobes, 6) of the rows, to broadcast over a table (lobes, 6, 48)."""
    return numbers[:, :, None]


def _on_columns(numbers: np.ndarray) -> np.ndarray:
    """Table (lobes, 6, 48) of the numbers (lobes, 48) of its columns, their mean at the pole."""
    table = np.repeat(numbers[:, None], polar_grid.N_THETA, axis=1)
    table[:, 0] = numbers.mean(-1, keepdims=True)
    return table


@lru_cache(maxsize=1)
def _row_tents() -> tuple[np.ndarray, np.ndarray]:
    """Weights (6, 90) that take a curve over theta to the rows, of D and of G."""
    # D is constant beyond the last row, G falls to 0 at 90 degrees
    angles = np.minimum(theta_h_centres(), polar_grid.LAST_THETA), _masking_angles()
    return tuple(
        _normalized(1 - np.abs(theta - theta_nodes()[:, None]) / THETA_STEP) for theta in angles
    )


@lru_cache(maxsize=1)
def _column_tents() -> np.ndarray:
    """Weights (48, 90) that take a curve around to the columns."""
    apart = (_azimuths() - phi_nodes()[:, None] + np.pi) % (2 * np.pi) - np.pi
    return _normalized(1 - np.abs(apart) / PHI_STEP)


def _normalized(tents: np.ndarray) -> np.ndarray:
    weights = np.maximum(tents, 0)
    return weights / weights.sum(1, keepdims=True)


def _masking_angles() -> np.ndarray:
    return positions(MASKING_CURVES[0]) * HALF_PI


def _azimuths() -> np.ndarray:
    return positions(NDF_AROUND_CURVES[0]) * 2 * np.pi
