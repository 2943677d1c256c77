# SPDX-License-Identifier: GPL-3.0-or-later
"""The edits of a material, to be written down and given to another."""

from __future__ import annotations

import bpy

from ...fitter.curves import CURVES
from ...fitter.edit_document import EditDocument
from .. import curve_nodes
from ..edit_properties import set_sliders, sliders_of
from .drawn_curves import drawn_handles
from .own_nodes import group_of, own_group


def document_of(owner: bpy.types.Material) -> EditDocument:
    """The edits of a material, to be written down.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    now, drawn = curve_nodes.handles(group_of(owner)), drawn_handles(owner)
    names = [name for name in CURVES if name in now and name in drawn]
    return EditDocument(
        curves={name: now[name] for name in names},
        drawn={name: drawn[name] for name in names},
        sliders=sliders_of(owner.nfm.edit),
    )


def apply_document(owner: bpy.types.Material, document: EditDocument) -> None:
    """Give a material the edits of another: its sliders, and those curves that were edited.

    Raises
    ------
    ShaderError
        The material has lost its Script node or is linked.
    """
    edited = {
        name: handles
        for name, handles in document.curves.items()
        if handles != document.drawn[name]
    }
    curve_nodes.write(own_group(owner), edited)
    set_sliders(owner.nfm.edit, document.sliders)
