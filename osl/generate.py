# SPDX-License-Identifier: GPL-3.0-or-later
"""Fill the OSL templates with the tables of a material.

The result is self-contained: Cycles compiles a Script node's text from a temporary file, where our
own includes would not be found, and a .blend must render without the add-on.

Only numbers enter the source. No name or text of a user's file does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite
from pathlib import Path
from string import Template

SAMPLINGS = ("reference", "cosine")

# Candidates per shading point: 4 give the least error for their time (docs/RESULTS.md, Sampling).
# Cosine sampling is the naive baseline.
DEFAULT_CANDIDATES = {"reference": 4, "cosine": 1}


@dataclass(frozen=True)
class SurfaceTables:
    """Numbers of one material, flat and in the order that the shader indexes them.

    diffuse_albedo : 3, pi d_c
    scale : 9, lobe by lobe, channels within
    ndf, masking, fresnel : 270, three rows of 90
    nodes : 92, v = 1 - cos theta_h of the sampling density
    density, cumulative : 276, three rows of 92
    selection : 279, lobe by lobe, 31 view angles, channels within
    """

    diffuse_albedo: Sequence[float]
    scale: Sequence[float]
    ndf: Sequence[float]
    masking: Sequence[float]
    fresnel: Sequence[float]
    nodes: Sequence[float]
    density: Sequence[float]
    cumulative: Sequence[float]
    selection: Sequence[float]


_SIZES = {
    "diffuse_albedo": 3,
    "scale": 9,
    "ndf": 270,
    "masking": 270,
    "fresnel": 270,
    "nodes": 92,
    "density": 276,
    "cumulative": 276,
    "selection": 279,
}


def surface_shader(tables: SurfaceTables, sampling: str = "reference") -> str:
    """OSL source of the isotropic surface shader.

    sampling : one of SAMPLINGS

    Raises
    ------
    ValueError
        A table has the wrong size or a number is not finite, or the sampling is unknown.
    """
    if sampling not in SAMPLINGS:
        raise ValueError(f"sampling {sampling!r}, expected one of {', '.join(SAMPLINGS)}")
    for name, size in _SIZES.items():
        if len(getattr(tables, name)) != size:
            raise ValueError(f"{name}: {len(getattr(tables, name))} numbers, expected {size}")
    return _template("nfm_surface").substitute(
        lookup=_template("lookup").template,
        sampling=_template("sampling").template,
        specular=_template(sampling).template.rstrip(),
        candidates=DEFAULT_CANDIDATES[sampling],
        diffuse=_numbers(tables.diffuse_albedo),
        scale=_colors(tables.scale),
        ndf=_numbers(tables.ndf),
        masking=_numbers(tables.masking),
        fresnel=_numbers(tables.fresnel),
        nodes=_numbers(tables.nodes),
        density=_numbers(tables.density),
        cumulative=_numbers(tables.cumulative),
        selection=_colors(tables.selection),
    )


@cache
def _template(name: str) -> Template:
    return Template((Path(__file__).parent / f"{name}.osl.in").read_text(encoding="utf-8"))


def _number(value: float) -> str:
    if not isfinite(value):
        raise ValueError(f"{value} cannot be written into a shader")
    # nine digits are a single-precision number exactly
    return f"{value:.9g}"


def _numbers(values: Sequence[float]) -> str:
    return ", ".join(map(_number, values))


def _colors(values: Sequence[float]) -> str:
    triples = zip(values[::3], values[1::3], values[2::3], strict=True)
    return ", ".join(f"color({_numbers(triple)})" for triple in triples)
