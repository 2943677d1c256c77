# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables derived from a FactorModel: for sampling its lobes, and its directional albedo.

Sampling (Peng et al. 2017, section 2.5). A half vector is drawn from the density c D(theta_h)
cos(theta_h) per solid angle, with

    2 pi c  int D cos(theta_h) sin(theta_h) dtheta_h = 1                       (eq. 9)

Eq. 8 of the paper discretises this with a constant dtheta_h, but the MERL axis is a square root.
With v = 1 - cos(theta_h) the measure is 2 pi dv, exactly, on any axis. The tables hold the density
at the nodes of D as a piecewise linear function of v, so that it follows D within a bin too and
inverting its integral is one square root.

v itself is used, never cos(theta_h): for a mirror-like lobe v ~ 1e-9 and 1 - v would lose it in
single precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import HALF_PI, N_THETA_H, theta_h_centres, theta_h_from_index, versine
from ..quadrature import HalfVectors
from . import quick_albedo
from .model import FactorModel
from .quick_albedo import views_at


def versine_nodes() -> np.ndarray:
    """Nodes v (92,) of the sampling density: 0, the 90 bin centres of theta_h, 1."""
    return np.concatenate([[0.0], versine(theta_h_centres()), [1.0]])


@dataclass(frozen=True)
class SamplingTables:
    """Densities of the half vector for each lobe.

    density : (lobes, 92) per solid angle (1/sr) at versine_nodes(), linear in v between
    cumulative : (lobes, 92) its integral from v = 0, from 0 to 1
    """

    density: np.ndarray
    cumulative: np.ndarray


def sampling_tables(model: FactorModel) -> SamplingTables:
    """Normalised D cos(theta_h) of every lobe; a lobe with D = 0 everywhere gets cos(theta_h)."""
    nodes = versine_nodes()
    ndf = np.concatenate([model.ndf[:, :1], model.ndf, model.ndf[:, -1:]], axis=1)
    empty = ~(ndf > 0).any(axis=1, keepdims=True)
    density = np.where(empty, 1.0, ndf) * (1 - nodes)
    areas = np.pi * (density[:, 1:] + density[:, :-1]) * np.diff(nodes)
    cumulative = np.concatenate([np.zeros((len(areas), 1)), np.cumsum(areas, axis=1)], axis=1)
    total = cumulative[:, -1:]
    return SamplingTables(density / total, cumulative / total)


# Nodes of the lobe-selection table over the view angle: every 3 degrees.
N_SELECTION = 31


def selection_table(model: FactorModel) -> np.ndarray:
    """Directional albedo (lobes, 31, 3) of each lobe at view angles 0, 3, ... 90 degrees.

    It decides how often a lobe is sampled, so a few per cent are enough. At 90 degrees it holds
    the value just above the horizon.
    """
    theta_o = np.linspace(0, HALF_PI, N_SELECTION)
    theta_o[-1] = np.radians(89.5)
    return np.moveaxis(quick_albedo.lobe_albedo(model, views_at(theta_o)), 0, 1)


def directional_albedo(model: FactorModel, theta_o: np.ndarray) -> np.ndarray:
    """Share of the light from theta_o (n,) that is reflected: (n, 3), 1 is all of it."""
    return np.pi * model.diffuse + lobe_albedo(model, theta_o).sum(1)


def largest_directional_albedo(model: FactorModel) -> float:
    """The largest albedo over channels and view angles from 0 to 88 degrees."""
    return float(directional_albedo(model, np.radians(np.arange(0, 89, 4.0))).max())


def lobe_albedo(
    model: FactorModel, theta_o: np.ndarray, *, n_phi: int = 96, n_per_bin: int = 4
) -> np.ndarray:
    """Directional albedo (n, lobes, 3) of the lobes at view angles theta_o (n,), radians.

    Integrates f cos(theta_i) over half vectors: Gauss-Legendre points, n_per_bin (even) in each bin
    of theta_h, midpoints over half the azimuths (the other half is its mirror image).
    """
    points, gauss = np.polynomial.legendre.leggauss(n_per_bin // 2)
    # D has its kinks at the bins' centres: each half is integrated by itself
    index = (np.arange(2 * N_THETA_H)[:, None] / 2 + (points + 1) / 4).ravel()
    theta_h = theta_h_from_index(index)
    # 2 pi sin(theta_h) dtheta_h, dtheta_h = pi/2 * 2 index / 90^2 dindex
    ring = np.sin(theta_h) * np.pi**2 * 2 * index / N_THETA_H**2 * np.tile(gauss / 4, 2 * N_THETA_H)
    half_vectors = HalfVectors.on_rings(theta_h, ring, n_phi)

    out = np.empty((len(theta_o), model.n_lobes, 3))
    for row, theta in enumerate(theta_o):
        view = half_vectors.at_view(theta)
        values = model.lobe_values(view.wi, view.wo[None])
        out[row] = np.einsum("n,mnc->mc", view.wi[:, 2] * view.solid_angle, values)
    return out
