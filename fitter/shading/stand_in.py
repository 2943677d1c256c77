# SPDX-License-Identifier: GPL-3.0-or-later
"""The model as plain closures, for engines that cannot run the shader: Lambert and GGX lobes.

Each lobe becomes a GGX lobe whose half vectors are distributed as nearly as possible like the
lobe's, and whose colour at every view angle is the lobe's directional albedo over that of a white
GGX lobe, which loses light between facets. So the energy is right at all view angles, and the shape
of a highlight as far as GGX can follow it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..geometry import theta_h_centres
from ..models import quick_albedo
from ..models.factors import Factors
from ..models.model import FactorModel
from ..models.quick_albedo import views_at
from ..models.splines import masking_nodes
from ..models.tables import sampling_tables, versine_nodes
from ..quadrature import ViewQuadrature, view_quadrature
from .closures import Closure

# View angles of the colours, degrees: dense where Fresnel rises.
VIEW_ANGLES = (0.0, 20.0, 35.0, 48.0, 58.0, 66.0, 72.0, 77.0, 81.0, 84.0, 87.0, 89.5)

# Of the integral of a GGX lobe: half vectors, azimuths.
POINTS = (96, 16)

AZIMUTHS = 48

ALPHAS = np.geomspace(2e-3, 1, 160)


@dataclass(frozen=True)
class StandIn:
    """Plain closures in place of a model.

    diffuse : (3,) albedo
    alpha : (lobes,) width of each GGX lobe; the roughness of a node is its square root
    cosines : (n,) of VIEW_ANGLES
    colors : (lobes, n, 3) of the lobes at these view angles; above 1 where a GGX lobe loses more
    albedo : (lobes, n, 3) directional albedo of the lobes at these view angles
    """

    diffuse: np.ndarray
    alpha: np.ndarray
    cosines: np.ndarray
    colors: np.ndarray
    albedo: np.ndarray


def stand_in(model: Factors) -> StandIn:
    """The closures that stand in for a model; an anisotropic one is averaged over azimuths."""
    model = without_direction(model)
    theta_o = np.radians(VIEW_ANGLES)
    albedo = np.moveaxis(quick_albedo.lobe_albedo(model, views_at(theta_o)), 0, 1)
    alpha = matched_alpha(model)
    return StandIn(
        diffuse=np.pi * model.diffuse,
        alpha=alpha,
        cosines=np.cos(theta_o),
        colors=albedo / np.array([_ggx_albedo(width) for width in alpha.tolist()])[..., None],
        albedo=albedo,
    )


def without_direction(model: Factors) -> FactorModel:
    """An isotropic model: the mean of D and G over azimuths, where they depend on one."""
    if model.kind != "anisotropic":
        return model
    phi = (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * 2 * np.pi

    def mean(evaluate: Callable, theta: np.ndarray) -> np.ndarray:
        values = evaluate(np.repeat(theta, AZIMUTHS), np.tile(phi, len(theta)))
        return values.reshape(len(values), -1, AZIMUTHS).mean(-1)

    return FactorModel(
        diffuse=model.diffuse,
        scale=model.scale,
        ndf=mean(model.evaluate_ndf, theta_h_centres()),
        masking=mean(model.evaluate_masking, masking_nodes()),
        fresnel=model.fresnel,
    )


def matched_alpha(model: FactorModel) -> np.ndarray:
    """Alpha (lobes,) of the GGX lobes whose half vectors are distributed most alike.

    Compares cumulative distributions of D cos(theta_h); that of GGX is
    sin^2 / (alpha^2 cos^2 + sin^2) (Walter et al. 2007, eq. 35, solved for the random number).
    """
    versine = versine_nodes()
    sin2 = versine * (2 - versine)
    cumulative = sin2 / (ALPHAS[:, None] ** 2 * (1 - sin2) + sin2)
    wanted = sampling_tables(model).cumulative
    error = ((cumulative - wanted[:, None]) ** 2).sum(-1)
    return ALPHAS[error.argmin(1)]


@lru_cache(maxsize=len(ALPHAS))
def _ggx_albedo(alpha: float) -> np.ndarray:
    """Directional albedo (n,) of a white GGX lobe at VIEW_ANGLES, single scattering as Cycles'."""
    lobe = Closure("ggx", alpha)
    return np.array([lobe.columns(v.wi, v.wo).sum(0) @ v.solid_angle for v in _ggx_views()])


@lru_cache(maxsize=1)
def _ggx_views() -> list[ViewQuadrature]:
    return [view_quadrature(theta, *POINTS) for theta in np.radians(VIEW_ANGLES).tolist()]
