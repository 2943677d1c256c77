# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as assets, for Blender's asset browser."""

from __future__ import annotations

import bpy
import numpy as np


def mark(item: bpy.types.Material, icon: np.ndarray) -> None:
    """Mark a material of ours as an asset with tags, a description and a picture.

    icon : RGBA (n, n, 4) display values 0..1, bottom row first
    """
    item.asset_mark()
    settings, data = item.nfm, item.asset_data
    for tag in ("measured", settings.source_format.lower()):
        if tag:
            data.tags.new(tag, skip_if_exists=True)
    data.description = f"Measured BRDF: {settings.source}" if settings.source else "Measured BRDF"
    set_icon(item, icon)


def set_icon(item: bpy.types.Material, icon: np.ndarray) -> None:
    """Give a datablock a preview of its own; see `mark`."""
    preview = item.preview_ensure()
    preview.image_size = icon.shape[1::-1]
    preview.image_pixels_float.foreach_set(np.ravel(icon).astype(np.float32))
