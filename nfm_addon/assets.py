# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as assets, for Blender's asset browser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np


@dataclass(frozen=True)
class Metadata:
    """What the asset browser says about a material.

    catalogue : with its parents, such as "Measured/Metal"; empty for none
    tags : besides those of `mark`
    """

    description: str = ""
    catalogue: str = ""
    author: str = ""
    license: str = ""
    tags: Sequence[str] = ()


def mark(item: bpy.types.Material, icon: np.ndarray, metadata: Metadata | None = None) -> None:
    """Mark a material of ours as an asset with tags, a description and a picture.

    icon : RGBA (n, n, 4) display values 0..1, bottom row first
    metadata : default: that it is a measured material, and of which file
    """
    item.asset_mark()
    settings, data = item.nfm, item.asset_data
    if metadata is None:
        source = settings.source
        metadata = Metadata(
            f"Measured BRDF: {source}" if source else "Measured BRDF",
            tags=("measured", settings.source_format.lower()),
        )
    for tag in filter(None, metadata.tags):
        data.tags.new(tag, skip_if_exists=True)
    for name in ("description", "author", "license"):
        setattr(data, name, getattr(metadata, name))
    set_icon(item, icon)


def set_icon(item: bpy.types.Material, icon: np.ndarray) -> None:
    """Give a datablock a preview of its own; see `mark`."""
    preview = item.preview_ensure()
    preview.image_size = icon.shape[1::-1]
    preview.image_pixels_float.foreach_set(np.ravel(icon).astype(np.float32))
