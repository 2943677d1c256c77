# SPDX-License-Identifier: GPL-3.0-or-later
"""NAME.nfm.json: a fitted material as readable UTF-8 JSON, format version 1.

Fields: `format` "nfm", `version` 1, `model` "shared3", `kind` "isotropic" or "anisotropic", `name`;
`diffuse` [3], `scale` [lobe][channel], `F` [channel][90]; `D` and `G` [lobe][90], anisotropic
[lobe][6][48]; `grids` with the node positions in radians, of `theta_h`, `theta` and `theta_d`,
anisotropic of `theta`, `phi` (both for D and G) and `theta_d`; `interpolation` of each factor;
`source` (file, format, sha256) of the measurement; `fit` (objective, iterations, weight, metrics);
and, in presets only, `edits` (edit_document.py), which leave the tables as measured.

Files come from strangers. Loading checks every field and executes nothing; strings are kept as
data only.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from .. import polar_grid
from ..editing import edit_document
from ..editing.edit_document import EditDocument
from ..errors import ParameterFileError, shown_name
from ..files import write_atomically
from ..geometry import theta_d_centres, theta_h_centres
from ..measurement import Source
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import Factors
from ..models.model import FactorModel
from ..models.splines import masking_nodes

FORMAT = "nfm"
VERSION = 1
MODEL = "shared3"
SUFFIX = ".nfm.json"

# A fit is about 20 kB; nothing honest comes near these.
MAX_FILE_SIZE = 4 << 20
MAX_NUMBER = 1e12
MAX_STRING = 1024

GRID_DIGITS = 8  # of a compact file; loading compares within 1e-6


@dataclass(frozen=True)
class _Kind:
    """What differs between isotropic and anisotropic files.

    table : shape of the D and G of one lobe
    grids : nodes by name
    """

    model: type[Factors]
    table: tuple[int, ...]
    interpolation: dict[str, str]
    grids: Callable[[], dict[str, np.ndarray]]

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        return {
            "diffuse": (3,),
            "scale": (3, 3),
            "D": (3, *self.table),
            "G": (3, *self.table),
            "F": (3, 90),
        }


_KINDS = {
    "isotropic": _Kind(
        FactorModel,
        (90,),
        {"D": "linear-sqrt", "G": "catmull-rom", "F": "linear"},
        lambda: {
            "theta_h": theta_h_centres(),
            "theta": masking_nodes(),
            "theta_d": theta_d_centres(),
        },
    ),
    "anisotropic": _Kind(
        AnisotropicModel,
        polar_grid.GRID,
        {"D": "bilinear", "G": "bilinear", "F": "linear"},
        lambda: {
            "theta": polar_grid.theta_nodes(),
            "phi": polar_grid.phi_nodes(),
            "theta_d": theta_d_centres(),
        },
    ),
}


@dataclass(frozen=True)
class FittedMaterial:
    """A model with its name and history.

    fit : figures of the fit by name, numbers and short strings; {} if unknown
    edits : what an artist changed, apart from the model; None in files of a fit
    """

    name: str
    model: Factors
    source: Source | None = None
    fit: dict[str, float | int | str] = field(default_factory=dict)
    edits: EditDocument | None = None


def dumps(material: FittedMaterial, digits: int | None = None) -> str:
    """Text of a parameter file; the same material gives the same text.

    digits : significant ones of every number of the model; None for all, which loses nothing. With
        5, numbers are off by at most 5e-5 of themselves, far less than any fit, and the text is
        half as long. Grids keep what loading checks.
    """
    model, source = material.model, material.source
    kind = _KINDS[model.kind]
    document = {
        "format": FORMAT,
        "version": VERSION,
        "model": MODEL,
        "kind": model.kind,
        "name": material.name,
        "diffuse": model.diffuse.tolist(),
        "scale": model.scale.tolist(),
        "D": model.ndf.tolist(),
        "G": model.masking.tolist(),
        "F": model.fresnel.tolist(),
        "grids": {name: nodes.tolist() for name, nodes in kind.grids().items()},
        "interpolation": kind.interpolation,
        "source": source
        and {"file": source.file_name, "format": source.format, "sha256": source.sha256},
        "fit": material.fit,
    }
    if material.edits is not None:
        document["edits"] = edit_document.to_json(material.edits)
    if digits is not None:
        places = dict.fromkeys(("diffuse", "scale", "D", "G", "F", "fit"), digits)
        places["grids"] = GRID_DIGITS
        document = {
            key: _rounded(value, places[key]) if key in places else value
            for key, value in document.items()
        }
    separators = None if digits is None else (",", ":")
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, allow_nan=False, separators=separators)}"
        for key, value in document.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _rounded(value: object, digits: int) -> object:
    """The same with every float of so many significant digits, whole ones written without .0."""
    if isinstance(value, dict):
        return {key: _rounded(item, digits) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item, digits) for item in value]
    if not isinstance(value, float):
        return value
    value = float(f"{value:.{digits}g}")
    return int(value) if value.is_integer() and abs(value) < 1e6 else value


def loads(text: str, name: str = "parameters") -> FittedMaterial:
    """Material from the text of a parameter file; `name` is what messages call it.

    Raises
    ------
    ParameterFileError
        Anything about the text is not as the format says.
    """
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else error
        raise ParameterFileError(f"{name}: not valid JSON ({reason}); export it again") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ParameterFileError(
            f'{name}: no "format": "nfm" at the top level; choose a {SUFFIX} file'
        )
    version = document.get("version")
    if version != VERSION or version is True:
        raise ParameterFileError(
            f"{name}: format version {_excerpt(version)}, this add-on reads "
            f"version {VERSION}; update the add-on"
        )
    # a list cannot be looked up, and a file may hold anything
    kind = next((k for n, k in _KINDS.items() if document.get("kind") == n), None)
    if kind is None:
        raise ParameterFileError(
            f'{name}: "kind" is {_excerpt(document.get("kind"))}, expected '
            f"{' or '.join(map(repr, _KINDS))}; update the add-on or export the file again"
        )
    for key, expected in (("model", MODEL), ("interpolation", kind.interpolation)):
        if document.get(key) != expected:
            raise ParameterFileError(
                f'{name}: "{key}" is {_excerpt(document.get(key))}, expected '
                f"{_excerpt(expected)}; update the add-on or export the file again"
            )
    grids = document.get("grids")
    for key, nodes in kind.grids().items():
        found = _numbers(grids if isinstance(grids, dict) else {}, key, nodes.shape, name)
        if not np.allclose(found, nodes, rtol=0, atol=1e-6):
            raise ParameterFileError(
                f'{name}: the grid "{key}" is not that of format version 1; export it again'
            )
    values = {key: _numbers(document, key, shape, name) for key, shape in kind.shapes.items()}
    if kind.model is AnisotropicModel:
        _check_poles(values, name)
    return FittedMaterial(
        name=_string(document, "name", name),
        model=kind.model(
            diffuse=values["diffuse"],
            scale=values["scale"],
            ndf=values["D"],
            masking=values["G"],
            fresnel=values["F"],
        ),
        source=_source(document.get("source"), name),
        fit=_figures(document.get("fit"), name),
        edits=_edits(document["edits"], document["kind"], name) if "edits" in document else None,
    )


def _edits(document: object, kind: str, name: str) -> EditDocument:
    edits = edit_document.from_json(document, name)
    if edits.blend is None:
        return edits
    other = loads(edits.blend.parameters, f'"blend" of {name}')
    if other.model.kind != kind:
        raise ParameterFileError(
            f'{name}: the model is {kind} and that of "blend" {other.model.kind}; save it again'
        )
    return replace(edits, blend=replace(edits.blend, parameters=dumps(other)))


def save(path: str | os.PathLike, material: FittedMaterial, digits: int | None = None) -> None:
    """Write a parameter file, all or nothing; `digits` as in dumps.

    Raises
    ------
    ParameterFileError
        The file cannot be written, or `load` would refuse it; an existing one is left as it was.
    """
    try:
        text = dumps(material, digits)
        loads(text, shown_name(path))
        write_atomically(Path(path), [text.encode("utf-8")])
    except ParameterFileError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ParameterFileError(
            f"{shown_name(path)}: cannot be written ({reason}); choose another folder"
        ) from error


def load(path: str | os.PathLike) -> FittedMaterial:
    """Read a parameter file.

    Raises
    ------
    ParameterFileError
        The file cannot be read, or anything in it is not as the format says.
    """
    name = shown_name(path)
    try:
        if not Path(path).is_file():
            raise ParameterFileError(f"{name}: no such file; check the path")
        size = Path(path).stat().st_size
        if size > MAX_FILE_SIZE:
            raise ParameterFileError(
                f"{name}: {size:,} bytes, a {SUFFIX} file has less than {MAX_FILE_SIZE:,}; "
                "choose another file"
            )
        text = Path(path).read_bytes().decode("utf-8")
    except UnicodeDecodeError:
        raise ParameterFileError(f"{name}: not UTF-8 text; choose a {SUFFIX} file") from None
    except (OSError, ValueError) as error:
        if isinstance(error, ParameterFileError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise ParameterFileError(
            f"{name}: cannot be read ({reason}); check its permissions"
        ) from error
    return loads(text, name)


def _check_poles(values: dict[str, np.ndarray], name: str) -> None:
    """At the pole phi means nothing: with different numbers the function would jump there."""
    for key in ("D", "G"):
        pole = values[key][:, 0]
        if not np.allclose(pole, pole[:, :1], rtol=1e-6, atol=0):
            raise ParameterFileError(
                f'{name}: the first row of a "{key}", theta = 0, holds different numbers, all 48 '
                "must be equal; export it again"
            )


def _numbers(document: dict, key: str, shape: tuple[int, ...], name: str) -> np.ndarray:
    """An array of exactly this shape whose numbers are finite, not negative and not absurd."""
    values = document.get(key)
    if not _has_shape(values, shape):
        wanted = " x ".join(map(str, shape))
        raise ParameterFileError(f'{name}: "{key}" is not {wanted} numbers; export it again')
    flat = np.array(values, dtype=object).ravel()
    for value in flat:
        # a comparison of the Python number: huge integers would overflow a float
        if not 0 <= value <= MAX_NUMBER:
            raise ParameterFileError(
                f'{name}: "{key}" holds {_excerpt(value)}, every number must be from 0 to '
                f"{MAX_NUMBER:g}; export it again"
            )
    return flat.astype(np.float64).reshape(shape)


def _has_shape(values: object, shape: tuple[int, ...]) -> bool:
    if not shape:
        return isinstance(values, (int, float)) and not isinstance(values, bool)
    return (
        isinstance(values, list)
        and len(values) == shape[0]
        and all(_has_shape(value, shape[1:]) for value in values)
    )


def _source(value: object, name: str) -> Source | None:
    if value is None:
        return None
    if not isinstance(value, dict):
        raise ParameterFileError(f'{name}: "source" is not an object; export it again')
    return Source(*(_string(value, key, name) for key in ("file", "format", "sha256")))


def _figures(value: object, name: str) -> dict[str, float | int | str]:
    if not isinstance(value, dict) or len(value) > 100:
        raise ParameterFileError(f'{name}: "fit" is not a short object; export it again')
    figures: dict[str, float | int | str] = {}
    for key, figure in value.items():
        if not key.isprintable() or len(key) > MAX_STRING:
            raise ParameterFileError(
                f'{name}: "fit" has the name {_excerpt(key)}, expected printable names of at most '
                f"{MAX_STRING} characters; export it again"
            )
        if isinstance(figure, str):
            figure = _string(value, key, name)
        elif not _has_shape(figure, ()) or not abs(figure) <= MAX_NUMBER:
            raise ParameterFileError(
                f'{name}: "fit" holds {_excerpt(figure)}, expected numbers and short strings; '
                "export it again"
            )
        figures[key] = figure
    return figures


def _string(document: dict, key: str, name: str) -> str:
    value = document.get(key)
    if not isinstance(value, str) or len(value) > MAX_STRING or not _is_text(value):
        raise ParameterFileError(
            f'{name}: "{key[:40]}" is not a string of at most {MAX_STRING} characters; '
            "export it again"
        )
    return value


def _is_text(value: str) -> bool:
    """Whether the string can be stored: JSON can spell half a surrogate pair, UTF-8 cannot."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _refuse_constant(constant: str) -> None:
    raise ValueError(f"{constant} is not a number of JSON")


def _excerpt(value: object) -> str:
    """A value from a file for a message: short, on one line."""
    text = ascii(value)
    return text if len(text) <= 40 else text[:37] + "..."
