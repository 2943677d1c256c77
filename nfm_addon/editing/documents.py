# SPDX-License-Identifier: GPL-3.0-or-later
"""The edits of a material, to be written down and given to another."""

from __future__ import annotations

import bpy

from ...fitter.editing.curves import CURVES
from ...fitter.editing.edit_document import BlendDocument, EditDocument
from ...fitter.errors import printable
from ...fitter.formats import parameter_file
from .. import curve_nodes
from ..edit_properties import set_sliders, sliders_of
from ..errors import ShaderError
from ..node_group import kind_of
from .drawn_curves import drawn_handles
from .own_nodes import group_of, own_group


def document_of(owner: bpy.types.Material) -> EditDocument:
    """The edits of a material, to be written down.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    edit = owner.nfm.edit
    now, drawn = curve_nodes.handles(group_of(owner)), drawn_handles(owner)
    names = [name for name in CURVES if name in now and name in drawn]
    return EditDocument(
        curves={name: now[name] for name in names},
        drawn={name: drawn[name] for name in names},
        sliders=sliders_of(edit),
        blend=BlendDocument(edit.blend_name, edit.blend, edit.blend_parameters)
        if edit.blend_parameters
        else None,
    )


def apply_document(owner: bpy.types.Material, document: EditDocument) -> None:
    """Give a material the edits of another: its sliders and blend, and curves that were edited.

    Raises
    ------
    ShaderError
        The material has lost its Script node or is linked, or the other one is blended with a
        material of another kind.
    """
    blend = document.blend
    if blend:
        kind = parameter_file.loads(blend.parameters).model.kind
        if kind != kind_of(group_of(owner)):
            raise ShaderError(
                f"{printable(blend.name)}, with which the preset blends, is {kind} and material "
                f"{owner.name!r} is not; load it into a material of the same kind"
            )
    edited = {
        name: handles
        for name, handles in document.curves.items()
        if handles != document.drawn[name]
    }
    curve_nodes.write(own_group(owner), edited)
    edit = owner.nfm.edit
    set_sliders(edit, document.sliders)
    edit.blend = blend.share if blend else 0.0
    if blend:
        edit.blend_name, edit.blend_parameters = blend.name, blend.parameters
