# SPDX-License-Identifier: GPL-3.0-or-later
"""Fill the OSL templates with the tables of a material.

The result is self-contained: Cycles compiles a Script node's text from a temporary file, where our
own includes would not be found, and a .blend must render without the add-on.

Only numbers enter the source. No name or text of a user's file does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite
from pathlib import Path
from string import Template

# native: the base alone. exact: the base and what it lacks, unbiased. smooth: the same with wide
# kernels. reference: mirrors in random directions of the factors. cosine: the naive baseline.
SAMPLINGS = ("native", "smooth", "exact", "reference", "cosine")
BASE_SAMPLINGS = ("native", "smooth", "exact")

# Candidates per shading point (docs/RESULTS.md, Sampling); native has none.
DEFAULT_CANDIDATES = {"native": 0, "smooth": 2, "exact": 2, "reference": 4, "cosine": 1}

# Cycles has room for 64 closures: the diffuse one takes 1, a microfacet closure with its Fresnel
# terms 2, a ramp with its colours 3.
CLOSURE_SLOTS = 64
SLOTS = {"ggx": 2, "beckmann": 2, "phong_ramp": 3, "diffuse_ramp": 3}
KINDS = ("ggx", "beckmann", "phong_ramp", "diffuse_ramp")
# Numbers that every closure has, in the order of the shader's parameters.
PER_CLOSURE = ("parameters", "across", "leans", "tilts", "azimuths")
COLUMNS = {"ggx": 2, "beckmann": 2, "phong_ramp": 8, "diffuse_ramp": 8}

# How many kernels of the residual fit into the solid angle that one direction stands for: so many
# that the blur is far below a picture's noise, or so few that light sampling sees them well.
KERNELS_PER_DIRECTION = {"exact": 1000.0, "smooth": 30.0}
LARGEST_EXPONENT = 1e5  # of a kernel
RESIDUAL_BOOST = {"exact": 3.0, "smooth": 1.0}

# Shares of the residual's directions that do not follow the lobes: in proportion to the cosine,
# and uniformly in h.
COSINE_SHARE, UNIFORM_SHARE = 0.2, 0.1


@dataclass(frozen=True)
class SurfaceTables:
    """Numbers of one material, flat and in the order that the shader indexes them.

    kind : "isotropic" or "anisotropic"
    diffuse_albedo : 3, pi d_c
    scale : 9, lobe by lobe, channels within
    tables : by the names of TABLES[kind]
    """

    kind: str
    diffuse_albedo: Sequence[float]
    scale: Sequence[float]
    tables: Mapping[str, Sequence[float]]


# Tables of each kind of model: how many numbers, rows of the lobes (or channels) one after another.
# ndf, masking and fresnel are the factors; fitter/models/tables.py and
# fitter/models/anisotropic_tables.py say what the others are. `selection` holds colours.
TABLES = {
    "isotropic": {
        "ndf": 3 * 90,
        "masking": 3 * 90,
        "fresnel": 3 * 90,
        "nodes": 92,
        "density": 3 * 92,
        "cumulative": 3 * 92,
        "selection": 3 * 31 * 3,
    },
    "anisotropic": {
        "ndf": 3 * 6 * 48,
        "masking": 3 * 6 * 48,
        "fresnel": 3 * 90,
        "nodes": 25,
        "density": 3 * 25,
        "cumulative": 3 * 25,
        "row_density": 3 * 25 * 48,
        "row_cumulative": 3 * 25 * 49,
        "selection": 3 * 16 * 24 * 3,
    },
}
COLOUR_TABLES = ("selection",)

# What each kind of model adds to the functions and to the sockets.
HALF_VECTORS = {
    "isotropic": ("isotropic_half_vector",),
    "anisotropic": ("anisotropic_half_vector", "material_frame"),
}
SOCKETS = {"isotropic": (), "anisotropic": ("anisotropic_sockets",)}


@dataclass(frozen=True)
class BaseTables:
    """The base lobes, flat and in the order that the shader indexes them.

    kinds : one of KINDS for each closure
    parameters : alpha along the tangent, or exponent, of each closure
    across : alpha across the tangent
    leans, tilts : of the normals of ramps, as fitter/shading/closures.py has them
    azimuths : of tangents and tilted normals, radians
    angles : view angles of the weights, radians, rising
    n_azimuths : how many azimuths of the viewer there are for each of the angles
    weights : view by view, lobe by lobe, column by column, channels within
    picking : view by view, lobe by lobe, closure by closure
    """

    kinds: Sequence[str]
    parameters: Sequence[float]
    across: Sequence[float]
    leans: Sequence[float]
    tilts: Sequence[float]
    azimuths: Sequence[float]
    angles: Sequence[float]
    n_azimuths: int
    weights: Sequence[float]
    picking: Sequence[float]

    @property
    def n_columns(self) -> int:
        """Columns of all closures."""
        return sum(COLUMNS[kind] for kind in self.kinds)

    @property
    def slots(self) -> int:
        """Room that the closures and the diffuse one take in Cycles."""
        return 1 + sum(SLOTS[kind] for kind in self.kinds)


def surface_shader(
    tables: SurfaceTables, sampling: str = "reference", base: BaseTables | None = None
) -> str:
    """OSL source of the surface shader.

    sampling : one of SAMPLINGS
    base : needed for BASE_SAMPLINGS, not used by the others

    Raises
    ------
    ValueError
        A table has the wrong size or a number is not finite, or there is no such sampling, or it
        lacks its base.
    """
    if sampling not in SAMPLINGS:
        raise ValueError(f"sampling {sampling!r}, expected one of {', '.join(SAMPLINGS)}")
    _check_sizes({"diffuse_albedo": 3, "scale": 9}, vars(tables))
    _check_sizes(TABLES[tables.kind], tables.tables)
    if sampling not in BASE_SAMPLINGS:
        definitions, parameters, specular = "", "", _text(sampling)
    else:
        if base is None:
            raise ValueError(f"sampling {sampling!r} needs base lobes")
        definitions = _base_definitions(base, sampling)
        parameters = _base_parameters(base)
        specular = _base_specular(base, sampling)
    return _template("nfm_surface").substitute(
        angles=_text("angles"),
        lookup=_text(f"{tables.kind}_lookup"),
        sampling=_text("sampling"),
        half_vector="\n".join(map(_text, HALF_VECTORS[tables.kind])),
        definitions=definitions,
        sockets="".join(map(_text, SOCKETS[tables.kind])),
        frame=_text(f"{tables.kind}_frame").rstrip(),
        tables=_table_parameters(tables),
        base_parameters=parameters,
        specular=specular.rstrip(),
        candidates=DEFAULT_CANDIDATES[sampling],
        diffuse=_numbers(tables.diffuse_albedo),
        scale=_colors(tables.scale),
    )


def _check_sizes(expected: Mapping[str, int], tables: Mapping[str, Sequence[float]]) -> None:
    for name, size in expected.items():
        if len(tables[name]) != size:
            raise ValueError(f"{name}: {len(tables[name])} numbers, expected {size}")


def _table_parameters(tables: SurfaceTables) -> str:
    lines = []
    for name, size in TABLES[tables.kind].items():
        values = tables.tables[name]
        if name in COLOUR_TABLES:
            lines.append(f"    color  {name}_table[{size // 3}] = {{{_colors(values)}}},\n")
        else:
            lines.append(f"    float  {name}_table[{size}] = {{{_numbers(values)}}},\n")
    return "".join(lines)


def _base_definitions(base: BaseTables, sampling: str) -> str:
    definitions = _template("base").substitute(
        n_closures=len(base.kinds),
        n_columns=base.n_columns,
        n_rows=len(base.angles),
        n_azimuths=base.n_azimuths,
        n_weights=len(base.weights),
        n_picking=len(base.picking),
    )
    if sampling == "native":
        return definitions
    lobe = _template("residual_lobe").substitute(
        kernels_per_direction=_float(KERNELS_PER_DIRECTION[sampling]),
        largest_exponent=_float(LARGEST_EXPONENT),
        residual_boost=_float(RESIDUAL_BOOST[sampling]),
        cosine_share=_float(COSINE_SHARE),
        uniform_share=_float(UNIFORM_SHARE),
    )
    return f"{definitions}\n{_text('base_value')}\n{lobe}"


def _base_specular(base: BaseTables, sampling: str) -> str:
    if sampling == "native":
        return _text("native")
    room = (CLOSURE_SLOTS - base.slots) // SLOTS["phong_ramp"]
    return _text("native") + _template("residual").substitute(most_candidates=room)


def _base_parameters(base: BaseTables) -> str:
    n_closures, n_angles = len(base.kinds), len(base.angles)
    n_views = n_angles * base.n_azimuths
    tables = {"weights": n_views * 9 * base.n_columns, "picking": n_views * 3 * n_closures}
    _check_sizes(dict.fromkeys(PER_CLOSURE, n_closures) | tables, vars(base))
    if base.slots + SLOTS["phong_ramp"] > CLOSURE_SLOTS:
        raise ValueError(f"{n_closures} closures take {base.slots} of {CLOSURE_SLOTS} places")
    kinds = ", ".join(str(KINDS.index(kind)) for kind in base.kinds)
    return (
        f"    int    closure_kinds[{n_closures}] = {{{kinds}}},\n"
        + "".join(
            f"    float  closure_{name}[{n_closures}] = {{{_numbers(getattr(base, name))}}},\n"
            for name in PER_CLOSURE
        )
        + f"    float  base_angles[{n_angles}] = {{{_numbers(base.angles)}}},\n"
        + "".join(
            f"    float  base_{name}[{size}] = {{{_numbers(vars(base)[name])}}},\n"
            for name, size in tables.items()
        )
    )


def _text(name: str) -> str:
    return _template(name).template


@cache
def _template(name: str) -> Template:
    return Template((Path(__file__).parent / f"{name}.osl.in").read_text(encoding="utf-8"))


def _float(value: float) -> str:
    """Literal that OSL takes as a float even where it is whole."""
    text = _numbers([value])
    return text if any(c in text for c in ".e") else f"{text}.0"


def _numbers(values: Sequence[float]) -> str:
    """Numbers, separated; nine digits are a single-precision number exactly."""
    if not all(map(isfinite, values)):
        bad = next(value for value in values if not isfinite(value))
        raise ValueError(f"{bad} cannot be written into a shader")
    # all at once: a call for each takes three times as long
    return ", ".join(["%.9g"] * len(values)) % tuple(values)


def _colors(values: Sequence[float]) -> str:
    triples = zip(values[::3], values[1::3], values[2::3], strict=True)
    return ", ".join(f"color({_numbers(triple)})" for triple in triples)
