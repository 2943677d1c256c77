# SPDX-License-Identifier: GPL-3.0-or-later
"""Wider and narrower highlights: the slopes of a lobe's microfacets are stretched.

Slopes, tan(theta_h), have the density D cos^4(theta_h). Stretched, that of GGX with roughness alpha
becomes that of width * alpha, and no direction leaves the hemisphere. The lobe keeps its light, the
integral of D cos(theta_h).
"""

from __future__ import annotations

import numpy as np

from .. import polar_grid
from ..geometry import theta_h_centres
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import Factors
from ..models.model import FactorModel
from ..models.tables import versine_nodes
from ..polar_grid import phi_nodes, theta_nodes


def stretched(
    model: Factors, lobe: int, along: float, across: float, direction: float = 0.0
) -> np.ndarray:
    """D of a lobe, at the nodes of its model, so many times as wide.

    along, across : as seen from a direction in the surface; an isotropic lobe takes the first
    direction : its azimuth, radians
    """
    if model.kind == "isotropic":
        return _stretched_ring(model, lobe, along)
    return _stretched_table(model, lobe, along, across, direction)


def _stretched_ring(model: FactorModel, lobe: int, width: float) -> np.ndarray:
    """D (90,) of an isotropic lobe."""
    theta_h = theta_h_centres()
    source = np.arctan(np.tan(theta_h) / width)
    ndf = model.evaluate_ndf(source)[lobe] * (np.cos(source) / np.cos(theta_h)) ** 4
    return _with_light_of(ndf, _light(ndf), _light(model.ndf[lobe]))


def _light(ndf: np.ndarray) -> float:
    """Integral of D (90,) cos theta_h over solid angle, but for a factor 2 pi."""
    nodes = versine_nodes()
    weighted = np.concatenate([ndf[:1], ndf, ndf[-1:]]) * (1 - nodes)
    return float((weighted[1:] + weighted[:-1]) @ np.diff(nodes) / 2)


def _stretched_table(
    model: AnisotropicModel, lobe: int, along: float, across: float, direction: float
) -> np.ndarray:
    """D (6, 48) of an anisotropic lobe."""
    theta, phi = (a.ravel() for a in np.meshgrid(theta_nodes(), phi_nodes(), indexing="ij"))
    slope_along = np.tan(theta) * np.cos(phi - direction) / along
    slope_across = np.tan(theta) * np.sin(phi - direction) / across
    source = np.arctan(np.hypot(slope_along, slope_across))
    azimuth = np.arctan2(slope_across, slope_along) + direction
    ndf = model.evaluate_ndf(source, azimuth)[lobe] * (np.cos(source) / np.cos(theta)) ** 4
    weight = np.cos(theta) * polar_grid.solid_angles()
    before = float(model.ndf[lobe].ravel() @ weight)
    return _with_light_of(ndf, float(ndf @ weight), before).reshape(polar_grid.GRID)


def _with_light_of(ndf: np.ndarray, light: float, wanted: float) -> np.ndarray:
    return ndf * (wanted / light if light > 0 else 1)
