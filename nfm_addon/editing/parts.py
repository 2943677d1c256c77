# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a material's edits that are copied and pasted: a curve, the colour curves, or a lobe.

A copy is plain data: what kind of part it is, the handles of its curves by their role in it, and
the sliders of a lobe.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import bpy

from ...fitter.editing.curves import CURVES, FRESNEL_CURVES, curves_of_lobe
from ...fitter.editing.edits import LobeSliders
from .. import curve_nodes
from ..edit_properties import LOBES, set_lobe_sliders, sliders_of
from ..errors import ShaderError
from ..node_group import kind_of
from .own_nodes import group_of, own_group

# Parts that are curves: those of F go together.
CURVE_PARTS = (*(name for name in CURVES if name not in FRESNEL_CURVES), FRESNEL_CURVES[0])


@dataclass(frozen=True)
class Part:
    """What is copied or pasted.

    kind : only parts of the same kind can be pasted: "D", "G around", ..., "F" or "lobe"
    curves : names of its curves by their role
    lobe : whose sliders belong to it, from 0
    """

    kind: str
    curves: dict[str, str]
    lobe: int | None = None


def curve_part(curve: str) -> Part:
    """One of CURVE_PARTS."""
    if curve in FRESNEL_CURVES:
        return Part("F", {name: name for name in FRESNEL_CURVES})
    return Part(_role(curve), {_role(curve): curve})


def lobe_part(owner: bpy.types.Material, lobe: int) -> Part:
    """A lobe (from 0) of a material, with the curves that its kind has.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    names = curves_of_lobe(lobe, kind_of(group_of(owner)))
    return Part("lobe", {_role(name): name for name in names}, lobe)


def copied(owner: bpy.types.Material, part: Part) -> dict:
    """A part as it is now, as json.dumps takes it.

    Raises
    ------
    ShaderError
        The material does not have such a curve.
    """
    found = curve_nodes.handles(group_of(owner))
    missing = [name for name in part.curves.values() if name not in found]
    if missing:
        raise ShaderError(f"material {owner.name!r} has no curve {missing[0]}; reset it first")
    content = {
        "kind": part.kind,
        "handles": {role: found[name] for role, name in part.curves.items()},
    }
    if part.lobe is not None:
        content["sliders"] = asdict(sliders_of(owner.nfm.edit).lobes[part.lobe])
    return content


def paste(owner: bpy.types.Material, part: Part, content: dict) -> None:
    """Give a part what was copied; a lobe of another kind of model, the curves that it has.

    Raises
    ------
    ShaderError
        What was copied is another kind of part, or the node group is linked.
    """
    if content["kind"] != part.kind:
        raise ShaderError(f"copied was {content['kind']}, expected {part.kind}; copy that first")
    handles = content["handles"]
    wanted = {name: handles[role] for role, name in part.curves.items() if role in handles}
    curve_nodes.write(own_group(owner), wanted)
    if part.lobe is not None:
        sliders = getattr(owner.nfm.edit, LOBES[part.lobe])
        set_lobe_sliders(sliders, LobeSliders(**content["sliders"]))


def _role(curve: str) -> str:
    """D, G, D around or G around of a lobe's curve."""
    return curve.split(maxsplit=2)[2]
