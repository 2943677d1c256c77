# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo of the anisotropic model, and keeping it below 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import polar_grid
from ..fitting.limits import MOST_ALBEDO, SAFE_ALBEDO
from ..geometry import HALF_PI
from ..models.anisotropic_model import AnisotropicModel
from ..quadrature import HalfVectors

# Midpoints of half vectors: 5 degrees by 3.75 degrees, three by two in every cell of D.
N_THETA_H, N_PHI_H = 18, 96

# Beyond the last row of nodes, where the model is its own continuation.
GRAZING = np.radians([82.5, 88.0])


def directional_albedo(model: AnisotropicModel, views: np.ndarray) -> np.ndarray:
    """Share of the light from unit directions views (n, 3) that is reflected: (n, 3)."""
    return np.pi * model.diffuse + lobe_albedo(model, views).sum(1)


def largest_directional_albedo(model: AnisotropicModel) -> float:
    """The largest albedo over channels and view directions down to 88 degrees."""
    return float(directional_albedo(model, _views()).max())


def lobe_albedo(model: AnisotropicModel, views: np.ndarray) -> np.ndarray:
    """Directional albedo (n, lobes, 3) of the lobes at unit view directions (n, 3)."""
    edges = np.linspace(0, HALF_PI, N_THETA_H + 1)
    ring = -np.diff(np.cos(edges)) * 2 * np.pi
    theta_h = (edges[1:] + edges[:-1]) / 2
    half_vectors = HalfVectors.on_rings(theta_h, ring, N_PHI_H, turn=2 * np.pi)
    out = np.empty((len(views), model.n_lobes, 3))
    for row, wo in enumerate(views):
        view = half_vectors.seen_from(wo)
        values = model.lobe_values(view.wi, wo[None])
        out[row] = (view.wi[:, 2] * view.solid_angle) @ values
    return out


def within_energy(model: AnisotropicModel) -> AnisotropicModel:
    """The model, or one that reflects no more than all light; as limits.within_energy."""
    lobes = lobe_albedo(model, _views()).sum(1)
    if (np.pi * model.diffuse + lobes).max() <= SAFE_ALBEDO:
        return model
    room = np.maximum(MOST_ALBEDO - np.pi * model.diffuse, 0)
    share = np.minimum(room / np.maximum(lobes, np.finfo(float).tiny), 1).min(1)
    nodes, grazing = share[: polar_grid.N_FREE].copy(), share[polar_grid.N_FREE :]
    # the last row of G stands for everything beyond it
    last = nodes[-polar_grid.N_PHI :]
    nodes[-polar_grid.N_PHI :] = np.minimum(last, grazing.reshape(len(GRAZING), -1).min(0))
    return replace(model, masking=model.masking * polar_grid.full_tables(nodes[None])).normalized()


def _views() -> np.ndarray:
    """The nodes that differ (241, 3), and the grazing angles at the azimuths of the nodes."""
    theta, phi = np.meshgrid(GRAZING, polar_grid.phi_nodes(), indexing="ij")
    nodes = polar_grid.directions()[polar_grid.N_PHI - 1 :]
    return np.concatenate([nodes, polar_grid.unit_vectors(theta.ravel(), phi.ravel())])
