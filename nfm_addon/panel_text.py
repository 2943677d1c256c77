# SPDX-License-Identifier: GPL-3.0-or-later
"""Text in panels, as it fits into their width."""

from __future__ import annotations

import textwrap

import bpy

UNIT = 20  # pixels of a button's height, at the usual resolution scale
CHARACTER = 6.4  # pixels of a letter in the mean, likewise
MARGIN = 2.6  # units at the sides of a panel
FACTOR = 0.4  # share of the width that Blender gives to the names of properties


def units_across(context: bpy.types.Context) -> float:
    """Width of the panel in units of a button's height."""
    scale = context.preferences.system.ui_scale
    return context.region.width / scale / UNIT - MARGIN


def paragraph(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE"
) -> None:
    """Text over as many lines as it takes, with an icon before the first."""
    letters = int((units_across(context) - 1.5) * UNIT / CHARACTER)
    column = layout.column(align=True)
    for number, line in enumerate(textwrap.wrap(text, max(letters, 16))):
        column.label(
            text=line, icon="BLANK1" if number and icon != "NONE" else icon, translate=False
        )


def fact(layout: bpy.types.UILayout, name: str, text: str) -> None:
    """A name and what goes with it, where properties have their names and values."""
    row = layout.split(factor=FACTOR, align=True)
    left = row.row()
    left.alignment = "RIGHT"
    left.label(text=name)
    row.label(text=text, translate=False)
