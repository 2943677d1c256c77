# SPDX-License-Identifier: GPL-3.0-or-later
"""The edits of a material as part of its parameter file.

They stand beside the measured tables, which they leave as they are: `curves` and `drawn` hold the
handles of every curve (curves.CURVES) as they are now and as they were drawn from the tables, each
[x, y, kind]; `sliders` those of edits.Sliders; `blend` the material that this one is blended with,
by its name, its share and its model. All that is not given is neutral.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from numbers import Real

from ..errors import ParameterFileError
from ..models.factors import N_LOBES
from .curves import CURVES
from .edits import RANGES, LobeSliders, Sliders

Handle = tuple[float, float, str]
Handles = Mapping[str, tuple[Handle, ...]]

# Kinds of handles, as Blender's curve widget names them.
HANDLE_KINDS = ("AUTO", "AUTO_CLAMPED", "VECTOR")
MOST_HANDLES = 256
FARTHEST_HANDLE = 100.0


@dataclass(frozen=True)
class BlendDocument:
    """The material that another one is blended with.

    name : of the material
    share : how much there is of it, 0 to 1
    parameters : its model, as the text of a parameter file without edits
    """

    name: str
    share: float
    parameters: str


@dataclass(frozen=True)
class EditDocument:
    """Edits that can be written down.

    curves, drawn : handles by the name of their curve; {} leaves the curves alone
    blend : None if there is nothing to blend with
    """

    curves: Handles = field(default_factory=dict)
    drawn: Handles = field(default_factory=dict)
    sliders: Sliders = field(default_factory=Sliders)
    blend: BlendDocument | None = None


def to_json(edits: EditDocument) -> dict:
    """What json.dumps takes."""
    document = {
        "curves": dict(edits.curves),
        "drawn": dict(edits.drawn),
        "sliders": asdict(edits.sliders),
    }
    if edits.blend:
        document["blend"] = {
            "name": edits.blend.name,
            "share": edits.blend.share,
            "model": json.loads(edits.blend.parameters),
        }
    return document


def from_json(document: object, name: str) -> EditDocument:
    """Edits from a parameter file; `name` is what messages call it.

    The model of the material that it is blended with is only taken along: parameter_file checks it.

    Raises
    ------
    ParameterFileError
        Anything is not as the format says.
    """
    parts = _object(document, {"curves", "drawn", "sliders", "blend"}, "edits", name)
    curves, drawn = (_curves(parts.get(key, {}), key, name) for key in ("curves", "drawn"))
    if curves.keys() != drawn.keys():
        raise _error(name, '"curves" and "drawn" of "edits" name different curves')
    blend = _blend(parts["blend"], name) if "blend" in parts else None
    return EditDocument(curves, drawn, _sliders(parts.get("sliders", {}), name), blend)


def _blend(document: object, name: str) -> BlendDocument:
    parts = _object(document, {"name", "share", "model"}, "blend", name)
    share = _number(parts.get("share", 0.0), (0.0, 1.0), "share", name)
    other, model = parts.get("name"), parts.get("model")
    if not isinstance(other, str) or not isinstance(model, dict):
        raise _error(name, '"blend" has no "name" and "model"')
    if "edits" in model:
        raise _error(name, 'the "model" of "blend" has edits of its own')
    return BlendDocument(other, share, json.dumps(model))


def _curves(document: object, key: str, name: str) -> Handles:
    curves = _object(document, set(CURVES), key, name)
    return {curve: _handles(handles, curve, name) for curve, handles in curves.items()}


def _handles(document: object, curve: str, name: str) -> tuple[Handle, ...]:
    if not isinstance(document, list) or not 2 <= len(document) <= MOST_HANDLES:
        raise _error(name, f'curve "{curve}" has not 2 to {MOST_HANDLES} handles')
    return tuple(_handle(handle, curve, name) for handle in document)


def _handle(document: object, curve: str, name: str) -> Handle:
    if not isinstance(document, list) or len(document) != 3 or document[2] not in HANDLE_KINDS:
        raise _error(name, f'a handle of curve "{curve}" is not [x, y, kind]')
    limits = (-FARTHEST_HANDLE, FARTHEST_HANDLE)
    x, y = (_number(value, limits, curve, name) for value in document[:2])
    return x, y, document[2]


def _sliders(document: object, name: str) -> Sliders:
    names = {item.name for item in fields(Sliders)}
    values = dict(_object(document, names, "sliders", name))
    lobes = values.pop("lobes", [{}] * N_LOBES)
    if not isinstance(lobes, list) or len(lobes) != N_LOBES:
        raise _error(name, f'"lobes" of "sliders" are not {N_LOBES}')
    tint = values.pop("edge_tint", [1.0] * 3)
    if not isinstance(tint, list) or len(tint) != 3:
        raise _error(name, '"edge_tint" is not a colour')
    return Sliders(
        lobes=tuple(LobeSliders(**_lobe(lobe, name)) for lobe in lobes),
        edge_tint=tuple(_number(c, RANGES["edge_tint"], "edge_tint", name) for c in tint),
        **{key: _number(value, RANGES[key], key, name) for key, value in values.items()},
    )


def _lobe(document: object, name: str) -> dict[str, float]:
    lobe = _object(document, {item.name for item in fields(LobeSliders)}, "lobes", name)
    return {key: _number(value, RANGES[key], key, name) for key, value in lobe.items()}


def _object(document: object, names: set[str], key: str, name: str) -> dict:
    if not isinstance(document, dict):
        raise _error(name, f'"{key}" is not an object')
    if not document.keys() <= names:
        raise _error(name, f'"{key}" has entries that this add-on does not know')
    return document


def _number(value: object, limits: tuple[float, float], key: str, name: str) -> float:
    low, high = limits
    if not isinstance(value, Real) or isinstance(value, bool) or not low <= value <= high:
        raise _error(name, f'"{key}" is not a number from {low:g} to {high:g}')
    return float(value)


def _error(name: str, what: str) -> ParameterFileError:
    return ParameterFileError(f"{name}: {what}; save the preset again")
