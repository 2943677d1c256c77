# SPDX-License-Identifier: GPL-3.0-or-later
"""material.nfm: what the add-on knows of a material. Documented API for scripts.

Everything but `sampling` is written by the add-on and read by everyone. It is stored in the .blend,
so a material can be edited where its measured file is not at hand.
"""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolVectorProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from bpy.utils import register_classes_factory

from . import changes
from .edit_properties import OVERRIDE, NFM_PG_edit

SAMPLING_ITEMS = (
    (
        "NATIVE",
        "Native",
        "Closures of Cycles that follow the measured lobes: lights are sampled, as clean as the "
        "Principled BSDF, with a small error that is shown below",
    ),
    (
        "SMOOTH",
        "Smooth",
        "Native plus a blurred correction: a smaller error for a little noise",
    ),
    (
        "EXACT",
        "Exact",
        "Native plus the whole difference to the model, drawn at random: unbiased, some noise "
        "under small lamps",
    ),
    (
        "REFERENCE",
        "Reference",
        "Importance sampling of the factors, unbiased; blind to lamps: small lights are noisy and "
        "lights of zero radius are not seen",
    ),
    (
        "COSINE",
        "Cosine",
        "Directions in proportion to the cosine, for comparison: slow to converge on anything "
        "glossy",
    ),
)

DEFAULT_SAMPLING = "NATIVE"

AUTOMATIC = "AUTO"

# Names are those of fitter.formats.utia.ENCODINGS.
ENCODING_ITEMS = (
    (AUTOMATIC, "Automatic", "As files of this format usually are"),
    ("linear", "Linear", "Radiometric values, as the UTIA database publishes them"),
    ("srgb-140", "sRGB, 140", "Values encoded for display with 140 as white, as in older files"),
)

QUALITY_ITEMS = (
    ("DRAFT", "Draft", "A first look, in about 2 seconds"),
    ("STANDARD", "Standard", "For most uses, in less than 10 seconds"),
    ("BEST", "Best", "More starts and steps, in less than 40 seconds; seldom looks different"),
)


def _sampling_changed(settings: NFM_PG_material, _context: bpy.types.Context) -> None:
    if settings.parameters:
        changes.sampling.tell(settings.id_data)


def _lobes_changed(settings: NFM_PG_material, _context: bpy.types.Context) -> None:
    if settings.parameters:
        changes.audible.tell(settings.id_data)


class NFM_PG_material(bpy.types.PropertyGroup):
    """The type of material.nfm."""

    parameters: StringProperty(
        name="Parameters",
        description="The fitted model as the text of an .nfm.json file; empty for other materials",
        options={"HIDDEN"},
        override=OVERRIDE,
    )
    source: StringProperty(
        name="Source",
        description="Name of the measured file, without its folder",
        override=OVERRIDE,
    )
    source_path: StringProperty(
        name="Source Path",
        description="Where the measured file was when it was imported, to fit it again",
        subtype="FILE_PATH",
        override=OVERRIDE,
    )
    slices: StringProperty(
        name="Slices",
        description="Values of the measurement in the plane of incidence, to compare with",
        options={"HIDDEN"},
        override=OVERRIDE,
    )
    token: StringProperty(
        name="Token",
        description="Says which import of this session the material comes from",
        options={"HIDDEN"},
    )
    quality: StringProperty(
        name="Quality",
        description="How long the fit took its time: draft, standard or best",
        override=OVERRIDE,
    )
    source_format: StringProperty(
        name="Format",
        description="Format of the measured file",
        override=OVERRIDE,
    )
    model: StringProperty(
        name="Model",
        description="Kind of factor model, such as shared3",
        override=OVERRIDE,
    )
    numbers: IntProperty(
        name="Numbers",
        description="How many numbers the model has",
        override=OVERRIDE,
    )
    objective: FloatProperty(
        name="Objective",
        description="Weighted squared error of the fit relative to the data (Peng et al. 2017, "
        "eq. 2)",
        precision=6,
        override=OVERRIDE,
    )
    iterations: IntProperty(
        name="Iterations",
        description="Steps of the fit",
        override=OVERRIDE,
    )
    mean_log_error: FloatProperty(
        name="Mean Log Error",
        description="Mean of |log(fit / data)| over all measured bins, weighted by solid angle",
        precision=4,
        override=OVERRIDE,
    )
    largest_directional_albedo: FloatProperty(
        name="Largest Albedo",
        description="The largest share of incoming light that is reflected, over view angles and "
        "channels; above 1 the material creates light",
        precision=4,
        override=OVERRIDE,
    )
    studio_psnr: FloatProperty(
        name="PSNR",
        description="Similarity of a picture of the fit and one of the measurement, on a sphere in "
        "a studio: dB, as displayed; from 45 on hardly anyone sees a difference",
        precision=1,
        override=OVERRIDE,
    )
    anisotropy_direction: FloatProperty(
        name="Main Direction",
        description="Where brush marks or the stronger threads lie, degrees counter-clockwise from "
        "the tangent at a Rotation of 0",
        precision=1,
    )
    anisotropy_strength: FloatProperty(
        name="Anisotropy",
        description="How much the main direction stands out: 0 not at all, or isotropic; 1 alone",
        precision=2,
    )
    native_error: FloatProperty(
        name="Native Error",
        description="Error of a picture in native sampling: sum of |difference| to the model's own "
        "over the sum, on a sphere in a studio",
        precision=4,
        override=OVERRIDE,
    )
    native_share: FloatProperty(
        name="Native Share",
        description="Share of the specular light that the native lobes reflect in the right "
        "directions",
        subtype="FACTOR",
        precision=3,
        override=OVERRIDE,
    )
    native_psnr: FloatProperty(
        name="Native PSNR",
        description="The same picture's PSNR against the model's own, dB, as displayed",
        precision=1,
        override=OVERRIDE,
    )
    mute: BoolVectorProperty(
        name="Mute",
        description="Leave this lobe out; its scale is kept",
        size=3,
        update=_lobes_changed,
        override=OVERRIDE,
    )
    solo: BoolVectorProperty(
        name="Solo",
        description="Show this lobe and the diffuse part only, and others on solo",
        size=3,
        update=_lobes_changed,
        override=OVERRIDE,
    )
    sampling: EnumProperty(
        name="Sampling",
        description="How Cycles samples the material",
        items=SAMPLING_ITEMS,
        default=DEFAULT_SAMPLING,
        update=_sampling_changed,
        override=OVERRIDE,
    )
    edit: PointerProperty(type=NFM_PG_edit, override=OVERRIDE)


_register_classes, _unregister_classes = register_classes_factory((NFM_PG_material,))


def register() -> None:
    _register_classes()
    bpy.types.Material.nfm = PointerProperty(type=NFM_PG_material, override=OVERRIDE)


def unregister() -> None:
    del bpy.types.Material.nfm
    _unregister_classes()
