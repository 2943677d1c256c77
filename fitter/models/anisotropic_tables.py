# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables derived from an AnisotropicModel: for sampling its lobes, and its directional albedo.

Sampling (Peng et al. 2017, section 2.5, for a D of two angles). A half vector is drawn from the
density c D(theta_h, phi_h) cos(theta_h) per solid angle. In v = 1 - cos(theta_h) and phi_h the
measure is dv dphi, so a density that is bilinear in them has exact marginals: its mean over phi is
linear in v, and its integral up to a given phi is linear in v too. `versine_nodes` are dense enough
that bilinear in v and bilinear in theta_h are nearly the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import HALF_PI, versine
from ..polar_grid import N_PHI, N_THETA, PHI_STEP, phi_nodes
from . import quick_albedo
from .anisotropic_model import AnisotropicModel

# Nodes of the sampling density in each row of the polar grid, and in all to 90 degrees.
NODES_PER_ROW = 4
N_DENSITY = NODES_PER_ROW * N_THETA + 1

# Nodes of the lobe-selection table: every 6 degrees of theta_o and every 15 of phi_o.
SELECTION_GRID = (16, 24)


def density_angles() -> np.ndarray:
    """Angles theta_h (25,) of the nodes of the sampling density, radians."""
    return np.linspace(0, HALF_PI, N_DENSITY)


@dataclass(frozen=True)
class AnisotropicSampling:
    """Densities of the half vector for each lobe.

    nodes : (25,) v = 1 - cos theta_h
    row_density : (lobes, 25, 48) per solid angle (1/sr) at the nodes and polar_grid.phi_nodes()
    row_cumulative : (lobes, 25, 49) integral of row_density over phi, from 0
    density : (lobes, 25) mean of row_density over phi
    cumulative : (lobes, 25) integral of the whole density from v = 0, from 0 to 1
    """

    nodes: np.ndarray
    row_density: np.ndarray
    row_cumulative: np.ndarray
    density: np.ndarray
    cumulative: np.ndarray


def anisotropic_sampling(model: AnisotropicModel) -> AnisotropicSampling:
    """Normalised D cos(theta_h) of every lobe; a lobe with D = 0 everywhere gets cos(theta_h)."""
    theta, phi = np.meshgrid(density_angles(), phi_nodes(), indexing="ij")
    shape = (model.n_lobes, N_DENSITY, N_PHI)
    ndf = model.evaluate_ndf(theta.ravel(), phi.ravel()).reshape(shape)
    empty = ~(ndf > 0).any(axis=(1, 2), keepdims=True)
    rows = np.where(empty, 1.0, ndf) * np.maximum(np.cos(theta), 0)
    steps = (rows + np.roll(rows, -1, axis=2)) / 2 * PHI_STEP
    row_cumulative = np.concatenate([np.zeros((*shape[:2], 1)), np.cumsum(steps, axis=2)], axis=2)
    marginal = row_cumulative[:, :, -1]
    nodes = versine(density_angles())
    areas = (marginal[:, 1:] + marginal[:, :-1]) / 2 * np.diff(nodes)
    cumulative = np.concatenate([np.zeros((len(areas), 1)), np.cumsum(areas, axis=1)], axis=1)
    total = cumulative[:, -1:]
    return AnisotropicSampling(
        nodes=nodes,
        row_density=rows / total[:, :, None],
        row_cumulative=row_cumulative / total[:, :, None],
        density=rows.mean(2) / total,
        cumulative=cumulative / total,
    )


def anisotropic_selection(model: AnisotropicModel) -> np.ndarray:
    """Directional albedo (lobes, 16, 24, 3) of each lobe, theta_o by phi_o.

    As tables.selection_table: a few per cent are enough, and the last row stands just above the
    horizon.
    """
    theta_o = np.linspace(0, HALF_PI, SELECTION_GRID[0])
    theta_o[-1] = np.radians(89.5)
    phi_o = np.arange(SELECTION_GRID[1]) / SELECTION_GRID[1] * 2 * np.pi
    views = tuple((theta, phi) for theta in theta_o.tolist() for phi in phi_o.tolist())
    albedo = quick_albedo.lobe_albedo(model, views)
    return np.moveaxis(albedo.reshape(*SELECTION_GRID, model.n_lobes, 3), 2, 0)
