# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the fitter and the shader meet: a model becomes OSL source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..fitter.models.anisotropic_tables import anisotropic_sampling, anisotropic_selection
from ..fitter.models.factors import Factors
from ..fitter.models.tables import sampling_tables, selection_table, versine_nodes
from ..fitter.shading.base_error import BaseError
from ..fitter.shading.base_lobes import BaseLobes, fit_base_lobes
from ..fitter.shading.closures import Closure
from ..fitter.shading.shading import shade
from ..osl import generate
from . import known_shadings

# Digits of the weights and picking shares of anisotropic base lobes, counted from the largest of a
# lobe at a view: 226,000 numbers, most of the room that a material takes in a .blend. Ramps have
# both signs and nearly cancel, so that with fewer digits the error of a base grows.
WEIGHT_DIGITS, PICKING_DIGITS = 6, 3


@dataclass(frozen=True)
class Surface:
    """A shader and what it leaves out.

    source : OSL
    albedo : (lobes, views, 3) directional albedo without the views at the horizon
    closures : of the base lobes, for the samplings that have them
    error : of the base lobes, if they are not those of a draft
    """

    source: str
    albedo: np.ndarray
    closures: tuple[Closure, ...] = ()
    error: BaseError | None = None

    @property
    def is_draft(self) -> bool:
        """Whether its base lobes are made quickly, and others will take their place."""
        return bool(self.closures) and self.error is None


def new_surface(
    model: Factors,
    sampling: str,
    *,
    draft: bool = False,
    closures: Sequence[Closure] | None = None,
) -> Surface:
    """Shader that renders the model with a sampling of generate.SAMPLINGS.

    draft : where the base lobes are not known, they are made of these closures if there are any,
        of anisotropic models at fewer views and else of closures that do for most, and without
        their error
    """
    selection = _selection(model)
    surface_tables = _surface_tables(model, selection)
    albedo = selection[:, :-1].reshape(model.n_lobes, -1, 3)
    if sampling not in generate.BASE_SAMPLINGS:
        return Surface(generate.surface_shader(surface_tables, sampling), albedo)
    shading = known_shadings.find(model)
    if shading is None and not draft:
        shading = known_shadings.remember(model, shade(model))
    base = shading.base if shading else fit_base_lobes(model, closures, draft=True)
    source = generate.surface_shader(surface_tables, sampling, _base_tables(base))
    return Surface(source, albedo, base.closures, shading and shading.error)


def _selection(model: Factors) -> np.ndarray:
    return anisotropic_selection(model) if model.kind == "anisotropic" else selection_table(model)


def _surface_tables(model: Factors, selection: np.ndarray) -> generate.SurfaceTables:
    if model.kind == "anisotropic":
        density = vars(anisotropic_sampling(model))
    else:
        density = {"nodes": versine_nodes(), **vars(sampling_tables(model))}
    tables = {
        "ndf": model.ndf,
        "masking": model.masking,
        "fresnel": model.fresnel,
        "selection": selection,
        **density,
    }
    return generate.SurfaceTables(
        kind=model.kind,
        diffuse_albedo=_flat(np.pi * model.diffuse),
        scale=_flat(model.scale),
        tables={name: _flat(table) for name, table in tables.items()},
    )


def _base_tables(base: BaseLobes) -> generate.BaseTables:
    weights, picking = base.weights, base.picking
    if weights.shape[1] > 1:
        weights, picking = _rounded(weights, WEIGHT_DIGITS), _rounded(picking, PICKING_DIGITS)
    return generate.BaseTables(
        kinds=[closure.kind for closure in base.closures],
        parameters=[closure.parameter for closure in base.closures],
        across=[closure.alphas[1] for closure in base.closures],
        leans=[closure.lean for closure in base.closures],
        tilts=[closure.tilt for closure in base.closures],
        azimuths=[closure.azimuth for closure in base.closures],
        angles=_flat(base.theta_o),
        n_azimuths=base.weights.shape[1],
        # the shader reads a column's three channels as one colour
        weights=_flat(weights.swapaxes(3, 4)),
        picking=_flat(picking),
    )


def _rounded(table: np.ndarray, digits: int) -> np.ndarray:
    """A table (rows, azimuths, lobes, ...) with so many digits of a lobe's largest at each view."""
    largest = np.abs(table).max(axis=tuple(range(3, table.ndim)), keepdims=True)
    unit = 10.0 ** (digits - 1 - np.floor(np.log10(np.where(largest > 0, largest, 1))))
    result = np.round(table * unit) / unit
    return result + 0.0  # no -0


def _flat(array: np.ndarray) -> list[float]:
    return np.ravel(array).tolist()
