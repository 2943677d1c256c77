# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several operators have, each defined once: quality: quality_option("...")."""

from __future__ import annotations

from bpy.props import BoolProperty, EnumProperty

from ..fitter.fitting.quality import DEFAULT_QUALITY
from .properties import AUTOMATIC, ENCODING_ITEMS, QUALITY_ITEMS


def quality_option(description: str, name: str = "Quality") -> object:
    """How long a fit may take."""
    return EnumProperty(
        name=name, description=description, items=QUALITY_ITEMS, default=DEFAULT_QUALITY.upper()
    )


def encoding_option(automatic: str = "as files of this format usually are") -> object:
    """What the numbers of UTIA files mean; `encoding_name` has it as the fitter takes it.

    automatic : what is taken if nothing is chosen
    """
    return EnumProperty(
        name="UTIA Encoding",
        description="How the numbers of a UTIA file (.bin, .exr) are taken; other formats have no "
        f"choice. Automatic: {automatic}",
        items=ENCODING_ITEMS,
        default=AUTOMATIC,
    )


def wait_option() -> object:
    """Whether an operator returns with the result."""
    return BoolProperty(
        name="Wait",
        description="Return when the fit is finished, as a script wants it; always so in the "
        "background",
        default=False,
        options={"HIDDEN", "SKIP_SAVE"},
    )


def encoding_name(choice: str) -> str | None:
    """The encoding for fitter.formats.readers.read; None for its default."""
    return None if choice == AUTOMATIC else choice
