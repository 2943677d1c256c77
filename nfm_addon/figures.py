# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of a fit in words, for the panel."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_iface as iface_

# From this PSNR on, dB, the words apply.
PSNR_WORDS = (
    (45, "no visible error"),
    (38, "hardly an error"),
    (32, "close"),
    (26, "visible errors"),
    (0, "poor"),
)

# From here on there is a warning.
LEAST_PSNR = 32
MOST_ALBEDO = 1.0
MOST_NATIVE_ERROR = 0.02


def facts(settings: bpy.types.PropertyGroup) -> list[tuple[str, str]]:
    """Where a material comes from and how good its fit is: names and values."""
    found = []
    if settings.source:
        found.append(("File", f"{settings.source} ({settings.source_format.upper()})"))
    model = iface_("3 lobes, {:d} numbers").format(settings.numbers)
    found.append(("Model", model))
    if settings.studio_psnr:
        word = next(word for least, word in PSNR_WORDS if settings.studio_psnr >= least)
        text = iface_("{:.0f} dB, {:s}").format(settings.studio_psnr, iface_(word))
        found.append(("PSNR", text))
    if settings.native_share:
        share = iface_("{:.1f} % of the light").format(100 * settings.native_share)
        found.append(("Native Lobes", share))
    return found


def native_error_text(settings: bpy.types.PropertyGroup) -> str:
    """The error of native sampling in one line."""
    if not settings.native_psnr:  # before the first finished shader
        return iface_("Being found")
    return iface_("{:.2f} %, {:.0f} dB").format(100 * settings.native_error, settings.native_psnr)


def warnings(settings: bpy.types.PropertyGroup) -> list[str]:
    """What is wrong with the fit, if anything."""
    found = []
    if settings.quality == "draft":
        found.append(iface_("A draft: refit it for the final quality"))
    if 0 < settings.studio_psnr < LEAST_PSNR:
        found.append(iface_("The fit differs visibly from the measurement"))
    if settings.largest_directional_albedo > MOST_ALBEDO:
        found.append(
            iface_("Reflects up to {:.0f} % of the light").format(
                100 * settings.largest_directional_albedo
            )
        )
    if settings.native_error > MOST_NATIVE_ERROR:
        found.append(iface_("Native sampling is far off: use Smooth or Exact"))
    return found
