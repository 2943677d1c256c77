# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures from which those of a base are picked, for isotropic and anisotropic models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..models.anisotropy import anisotropy
from ..models.factors import Factors
from .closures import Closure

# Microfacet roughnesses: ratio sqrt(2), from a mirror to matte.
_ALPHAS = (
    *(0.002, 0.003, 0.0045, 0.0065, 0.0095, 0.0135, 0.019, 0.027, 0.038),
    *(0.054, 0.076, 0.11, 0.155, 0.22, 0.31, 0.44, 0.62, 0.9),
)

CATALOGUE = (
    *(Closure("ggx", alpha) for alpha in _ALPHAS),
    *(Closure("beckmann", alpha) for alpha in _ALPHAS),
    Closure("diffuse_ramp"),
    *(Closure("phong_ramp", n) for n in (1, 4, 12, 40, 120, 400, 2000, 10000, 50000)),
    *(Closure("phong_ramp", n, lean) for lean in (0.5, 1.0) for n in (0, 2, 8, 40)),
    *(Closure("phong_ramp", n, lean) for lean in (-0.3, -0.6) for n in (2, 12, 60, 300)),
)

# What lies between nodes 15 degrees apart is no sharper than this.
_LEAST_ALPHA = 0.05
_SHARPEST = 120

# Roughnesses of closures with two of them, along a tangent and across.
_TWO_ALPHAS = tuple(
    (along, across)
    for along in (0.076, 0.13, 0.22, 0.38, 0.65)
    for across in (0.076, 0.13, 0.22, 0.38, 0.65)
    if along != across
)
_TANGENTS = np.radians([0, 45])  # from the main direction

# Ramps about normals of their own, such as threads have.
_TILTS = np.radians([8, 20, 35])
_TILTED_TO = np.radians(np.arange(0, 360, 45))  # from the main direction
_TILTED_EXPONENTS = (3, 12)

# For drafts of anisotropic models, azimuths from the main direction: picked as those of a material
# are, but for six materials together, brushed metals and woven cloths.
_DRAFT_CLOSURES = (
    Closure("diffuse_ramp"),
    *(Closure("phong_ramp", n) for n in (4, 40)),
    Closure("phong_ramp", 12, -0.3),
    Closure("ggx", 0.22, across=0.65),
    Closure("beckmann", 0.13, across=0.38),
    *(Closure("phong_ramp", 12, tilt=float(_TILTS[0]), azimuth=_TILTED_TO[to]) for to in (0, 4)),
    *(Closure("phong_ramp", 3, tilt=float(_TILTS[1]), azimuth=_TILTED_TO[to]) for to in (2, 6)),
)


def draft_closures(model: Factors) -> tuple[Closure, ...]:
    """Closures of anisotropic models for a base that has to be there at once; of others none.

    To pick those of a material takes a second.
    """
    if model.kind != "anisotropic":
        return ()
    main = np.radians(anisotropy(model).direction)
    return tuple(
        replace(closure, azimuth=float(main + closure.azimuth))
        if closure.tilt or closure.across
        else closure
        for closure in _DRAFT_CLOSURES
    )


def catalogue(model: Factors) -> tuple[Closure, ...]:
    """Candidates for the base of a model; the directions in them are its own."""
    if model.kind != "anisotropic":
        return CATALOGUE
    main = np.radians(anisotropy(model).direction)
    plain = (c for c in CATALOGUE if c.signed or c.parameter > _LEAST_ALPHA)
    return (
        *(c for c in plain if not c.signed or c.parameter <= _SHARPEST),
        *(
            Closure(kind, along, across=across, azimuth=float(main + tangent))
            for kind in ("ggx", "beckmann")
            for along, across in _TWO_ALPHAS
            for tangent in _TANGENTS
        ),
        *(
            Closure("phong_ramp", n, tilt=float(tilt), azimuth=float(main + towards))
            for n in _TILTED_EXPONENTS
            for tilt in _TILTS
            for towards in _TILTED_TO
        ),
    )
