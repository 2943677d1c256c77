# SPDX-License-Identifier: GPL-3.0-or-later
"""Images in and out of Blender as numpy arrays, linear and unmanaged."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..fitter.errors import NfmError, shown_name
from .whole_files import written_beside


def load_environment(path: Path) -> bpy.types.Image:
    """An environment map for a World.

    Raises
    ------
    NfmError
        The file is missing, or Blender cannot read it as an image.
    """
    try:
        # asked first, since Blender prints an error of its own
        if not path.is_file():
            raise FileNotFoundError
        image = bpy.data.images.load(str(path.resolve()))
    except (RuntimeError, OSError, ValueError):
        raise NfmError(f"{shown_name(path)}: no such image; check the path") from None
    if not image.has_data and not image.size[0]:
        bpy.data.images.remove(image)
        raise NfmError(f"{shown_name(path)}: cannot be read as an image; use .hdr or .exr")
    return image


def read_linear(path: Path) -> np.ndarray:
    """Pixels (height, width, 3) float32 of a linear file such as EXR or HDR, top row first."""
    image = load_environment(path)
    try:
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, -1)[::-1, :, :3].copy()
    finally:
        bpy.data.images.remove(image)


def write_linear(path: Path, pixels: np.ndarray) -> None:
    """Write (height, width, 3) as a 32-bit EXR, top row first.

    Raises
    ------
    NfmError
        The file cannot be written.
    """
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("nfm", width, height, float_buffer=True, is_data=True)
    _write(image, path, pixels, "OPEN_EXR")


def write_picture(path: Path, pixels: np.ndarray) -> None:
    """Write linear (height, width, 3), 0..1, as an sRGB PNG, top row first; the rest is clipped.

    Raises
    ------
    NfmError
        The file cannot be written.
    """
    linear = np.clip(pixels, 0, 1)
    # IEC 61966-2-1
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    height, width = pixels.shape[:2]
    _write(bpy.data.images.new("nfm", width, height), path, encoded, "PNG")


def _write(image: bpy.types.Image, path: Path, pixels: np.ndarray, file_format: str) -> None:
    """Fill the image, write it and remove it."""
    try:
        rgba = np.ones((*pixels.shape[:2], 4), np.float32)
        rgba[..., :3] = pixels[::-1]
        image.pixels.foreach_set(rgba.ravel())
        image.file_format = file_format
        with written_beside(path) as partial:
            image.filepath_raw = str(partial)
            image.save()
    finally:
        bpy.data.images.remove(image)
