# SPDX-License-Identifier: GPL-3.0-or-later
"""material.nfm.edit: the sliders of a material, and what goes with its curves.

Every slider can be keyframed and driven. Its default is neutral.
"""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    FloatProperty,
    FloatVectorProperty,
    PointerProperty,
    StringProperty,
)
from bpy.utils import register_classes_factory

from ..fitter.editing.edits import RANGES, LobeSliders, Sliders
from ..fitter.models.factors import N_LOBES
from . import changes

# A library override may change everything here, and keeps it.
OVERRIDE = {"LIBRARY_OVERRIDABLE"}

LOBES = tuple(f"lobe_{lobe + 1}" for lobe in range(N_LOBES))
LOBE_SLIDERS = ("width", "width_along", "width_across", "haze", "falloff", "gain")
# Those that an isotropic lobe does not have.
DIRECTIONAL_SLIDERS = ("width_along", "width_across")
MATERIAL_SLIDERS = (
    "edge_tint",
    "edge_strength",
    "specular_saturation",
    "specular_hue",
    "diffuse_saturation",
    "diffuse_hue",
)


def _changed(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    changes.edits.tell(settings.id_data)


def _slider(
    name: str, identifier: str, default: float, soft_max: float, description: str, **options: object
) -> object:
    low, high = RANGES[identifier]
    return FloatProperty(
        name=name,
        description=description,
        default=default,
        min=low,
        max=high,
        soft_max=soft_max,
        update=_changed,
        override=OVERRIDE,
        **options,
    )


class NFM_PG_lobe_sliders(bpy.types.PropertyGroup):
    """The type of material.nfm.edit.lobe_1 to lobe_3."""

    width: _slider(
        "Highlight Width",
        "width",
        1.0,
        4.0,
        "Makes this lobe's highlight wider (above 1) or sharper (below 1). It keeps its light: a "
        "wider highlight is a dimmer one",
    )
    width_along: _slider(
        "Width Along",
        "width_along",
        1.0,
        4.0,
        "Stretches this lobe's highlight along the brush marks or threads of the material",
    )
    width_across: _slider(
        "Width Across",
        "width_across",
        1.0,
        4.0,
        "Stretches this lobe's highlight across the brush marks or threads of the material, where "
        "it is the long one",
    )
    haze: _slider(
        "Haze",
        "haze",
        0.0,
        1.0,
        "Spreads some of the highlight into a veil around it, as dust or a worn polish does",
        subtype="FACTOR",
    )
    falloff: _slider(
        "Falloff",
        "falloff",
        1.0,
        2.0,
        "How soon this lobe fades where the surface turns away from the eye or the light: above 1 "
        "sooner, below 1 later",
    )
    gain: _slider("Gain", "gain", 1.0, 2.0, "Makes this lobe brighter or darker; 0 switches it off")


class NFM_PG_edit(bpy.types.PropertyGroup):
    """The type of material.nfm.edit."""

    lobe_1: PointerProperty(type=NFM_PG_lobe_sliders, override=OVERRIDE)
    lobe_2: PointerProperty(type=NFM_PG_lobe_sliders, override=OVERRIDE)
    lobe_3: PointerProperty(type=NFM_PG_lobe_sliders, override=OVERRIDE)
    edge_tint: FloatVectorProperty(
        name="Edge Tint",
        description="Colour that reflections take on towards the edges of a shape; white leaves "
        "them as measured",
        subtype="COLOR",
        size=3,
        default=(1.0, 1.0, 1.0),
        min=0.0,
        max=1.0,
        update=_changed,
        override=OVERRIDE,
    )
    edge_strength: _slider(
        "Edge Strength",
        "edge_strength",
        1.0,
        2.0,
        "How strong reflections are towards the edges of a shape: above 1 stronger than measured, "
        "below 1 weaker",
    )
    specular_saturation: _slider(
        "Saturation",
        "specular_saturation",
        1.0,
        2.0,
        "Colourfulness of the reflections: 0 is grey, 1 as measured",
    )
    specular_hue: _slider(
        "Hue",
        "specular_hue",
        0.0,
        3.15,
        "Turns the colour of the reflections around the colour wheel",
        subtype="ANGLE",
    )
    diffuse_saturation: _slider(
        "Saturation",
        "diffuse_saturation",
        1.0,
        2.0,
        "Colourfulness of the body colour: 0 is grey, 1 as measured",
    )
    diffuse_hue: _slider(
        "Hue",
        "diffuse_hue",
        0.0,
        3.15,
        "Turns the body colour around the colour wheel",
        subtype="ANGLE",
    )
    blend: FloatProperty(
        name="Blend",
        description="From this material (0) to the one that it is blended with (1)",
        default=0.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_changed,
        override=OVERRIDE,
    )
    blend_name: StringProperty(
        name="Blend With",
        description="Name of the material that this one is blended with",
        override=OVERRIDE,
    )
    blend_parameters: StringProperty(
        name="Blend Parameters",
        description="Its model when the two were joined, as the text of an .nfm.json file",
        options={"HIDDEN"},
        update=_changed,
        override=OVERRIDE,
    )
    show_original: BoolProperty(
        name="Show Original",
        description="Show the material as it was measured; the edits stay, and come back",
        update=_changed,
        override=OVERRIDE,
    )
    keep_energy: BoolProperty(
        name="Keep Energy",
        description="Lower the lobes where the edited material would reflect more light than it "
        "receives",
        update=_changed,
        override=OVERRIDE,
    )
    drawn: StringProperty(
        name="Drawn",
        description="Handles and heights of the curves as drawn from the measurement (JSON)",
        options={"HIDDEN"},
        override=OVERRIDE,
    )
    albedo: StringProperty(
        name="Albedo",
        description="Directional albedo of the edited lobes without their gains: view angles by "
        "lobes by channels (JSON)",
        options={"HIDDEN"},
        override=OVERRIDE,
    )


def sliders_of(edit: NFM_PG_edit) -> Sliders:
    """The sliders as plain numbers."""
    return Sliders(
        lobes=tuple(
            LobeSliders(*(_number(getattr(edit, lobe), name) for name in LOBE_SLIDERS))
            for lobe in LOBES
        ),
        edge_tint=tuple(edit.edge_tint),
        **{name: _number(edit, name) for name in MATERIAL_SLIDERS if name != "edge_tint"},
    )


def set_sliders(edit: NFM_PG_edit, sliders: Sliders) -> None:
    """Write plain numbers into the sliders."""
    for lobe, values in zip(LOBES, sliders.lobes, strict=True):
        set_lobe_sliders(getattr(edit, lobe), values)
    for name in MATERIAL_SLIDERS:
        setattr(edit, name, getattr(sliders, name))


def set_lobe_sliders(group: NFM_PG_lobe_sliders, sliders: LobeSliders) -> None:
    """Write plain numbers into the sliders of one lobe."""
    for name in LOBE_SLIDERS:
        setattr(group, name, getattr(sliders, name))


def _number(group: bpy.types.PropertyGroup, name: str) -> float:
    # pi in single precision is larger than pi
    low, high = RANGES[name]
    return min(max(getattr(group, name), low), high)


class NFM_PG_group(bpy.types.PropertyGroup):
    """The type of node_group.nfm."""

    applied: StringProperty(
        name="Applied",
        description="Which state of its material the group's shader was made for",
        options={"HIDDEN"},
    )
    closures: StringProperty(
        name="Closures",
        description="Those of the shader's base lobes, which drafts of an edit use again (JSON)",
        options={"HIDDEN"},
    )
    seams: StringProperty(
        name="Seams",
        description="Heights at which the curves around begin and end (JSON)",
        options={"HIDDEN"},
    )


_register_classes, _unregister_classes = register_classes_factory(
    (NFM_PG_lobe_sliders, NFM_PG_edit, NFM_PG_group)
)


def register() -> None:
    _register_classes()
    bpy.types.ShaderNodeTree.nfm = PointerProperty(type=NFM_PG_group)


def unregister() -> None:
    del bpy.types.ShaderNodeTree.nfm
    _unregister_classes()
