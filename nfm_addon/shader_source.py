# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the fitter and the shader meet: a FactorModel becomes OSL source."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..fitter.base_error import BaseError, base_error
from ..fitter.base_lobes import BaseLobes, fit_base_lobes
from ..fitter.closures import Closure
from ..fitter.model import FactorModel
from ..fitter.tables import sampling_tables, selection_table, versine_nodes
from ..osl import generate


@dataclass(frozen=True)
class Surface:
    """A shader and what it leaves out.

    source : OSL
    albedo : (lobes, 31, 3) of fitter.tables.selection_table
    closures : of the base lobes, for the samplings that have them
    error : of the base lobes, where it was asked for
    """

    source: str
    albedo: np.ndarray
    closures: tuple[Closure, ...] = ()
    error: BaseError | None = None


def new_surface(
    model: FactorModel,
    sampling: str,
    closures: Sequence[Closure] | None = None,
    *,
    graded: bool = True,
) -> Surface:
    """Shader that renders the model; sampling is one of generate.SAMPLINGS.

    closures : of the base lobes, which saves their selection
    graded : with the error of the base lobes
    """
    tables = sampling_tables(model)
    albedo = selection_table(model)
    surface_tables = generate.SurfaceTables(
        diffuse_albedo=_flat(np.pi * model.diffuse),
        scale=_flat(model.scale),
        ndf=_flat(model.ndf),
        masking=_flat(model.masking),
        fresnel=_flat(model.fresnel),
        nodes=_flat(versine_nodes()),
        density=_flat(tables.density),
        cumulative=_flat(tables.cumulative),
        selection=_flat(albedo),
    )
    if sampling not in generate.BASE_SAMPLINGS:
        return Surface(generate.surface_shader(surface_tables, sampling), albedo)
    base = fit_base_lobes(model, closures)
    source = generate.surface_shader(surface_tables, sampling, _base_tables(base))
    error = base_error(model, base) if graded else None
    return Surface(source, albedo, base.closures, error)


def _base_tables(base: BaseLobes) -> generate.BaseTables:
    return generate.BaseTables(
        kinds=[closure.kind for closure in base.closures],
        parameters=[closure.parameter for closure in base.closures],
        leans=[closure.lean for closure in base.closures],
        angles=_flat(base.theta_o),
        # the shader reads a column's three channels as one colour
        weights=_flat(np.moveaxis(base.weights, 2, 3)),
        picking=_flat(base.picking),
    )


def _flat(array: np.ndarray) -> list[float]:
    return np.ravel(array).tolist()
