# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials of the demo: of the shipped library, two of them changed by hand.

Names say which are measured and which are synthetic, as those of the library do.
"""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...fitter.formats import parameter_file
from ...fitter.formats.parameter_file import FittedMaterial
from ...fitter.jobs import library
from .. import curve_nodes, editing, material
from ..material_library import parameters_of

WOVEN = "shot-silk"  # of the cloths

# On the forms, front row from left to right, then the row behind.
PLAIN = ("cg_sunflower", "brushed-aluminium", "cc_green_malachite", "velvet-crimson", "porcelain")

EDITED, EDITED_NAME = "satin-gold", "Satin Gold, edited"
BLENDED, BLENDED_WITH = "car-paint-midnight", "satin-copper"
BLEND_NAME, BLEND = "Midnight Paint and Copper, blended", 0.5


def entry(key: str) -> FittedMaterial:
    """A material of the shipped library.

    Raises
    ------
    ParameterFileError
        Its file is missing or broken.
    """
    (found,) = (entry for entry in library.ENTRIES if entry.key == key)
    return parameter_file.load(parameters_of(found))


def edited() -> bpy.types.Material:
    """Gold with a haze, cool edges, and a second highlight that was cut off in its curve."""
    new = material.build(replace(entry(EDITED), name=EDITED_NAME))
    edit = new.nfm.edit
    edit.lobe_1.width = 0.6
    edit.lobe_1.haze = 0.35
    edit.edge_tint, edit.edge_strength = (0.25, 0.5, 1.0), 3.0
    handles = [(0.0, 1.0, "AUTO"), (0.35, 0.9, "AUTO"), (0.5, 0.35, "AUTO"), (1.0, 0.0, "AUTO")]
    curve_nodes.write(editing.group_of(new), {"Lobe 2 D": handles})
    editing.refresh(new)
    return new


def blended() -> bpy.types.Material:
    """Two materials of the library as one: half of the way from one to the other."""
    new = material.build(replace(entry(BLENDED), name=BLEND_NAME))
    other = entry(BLENDED_WITH)
    edit = new.nfm.edit
    edit.blend_name, edit.blend_parameters = other.name, parameter_file.dumps(other)
    edit.blend = BLEND
    editing.refresh(new)
    return new
