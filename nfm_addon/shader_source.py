# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the fitter and the shader meet: a FactorModel becomes OSL source."""

from __future__ import annotations

import numpy as np

from ..fitter.model import FactorModel
from ..fitter.tables import sampling_tables, selection_table, versine_nodes
from ..osl import generate


def surface_source(model: FactorModel, sampling: str) -> str:
    """OSL source that renders the model; sampling is one of generate.SAMPLINGS."""
    tables = sampling_tables(model)

    def flat(array: np.ndarray) -> list[float]:
        return np.ravel(array).tolist()

    return generate.surface_shader(
        generate.SurfaceTables(
            diffuse_albedo=flat(np.pi * model.diffuse),
            scale=flat(model.scale),
            ndf=flat(model.ndf),
            masking=flat(model.masking),
            fresnel=flat(model.fresnel),
            nodes=flat(versine_nodes()),
            density=flat(tables.density),
            cumulative=flat(tables.cumulative),
            selection=flat(selection_table(model)),
        ),
        sampling,
    )
