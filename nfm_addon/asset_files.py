# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of materials that the asset browser shows: a .blend for each, and their catalogues.

The materials are made in the file that is open, written, and removed again: nothing of it stays.
Every .blend is complete by itself, so that a folder can grow, and what is there is not made again.
"""

from __future__ import annotations

import secrets
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ..fitter.errors import NfmError, shown_name
from ..fitter.files import write_atomically
from ..fitter.formats.parameter_file import FittedMaterial
from . import assets, material
from .properties import DEFAULT_SAMPLING
from .whole_files import written_beside

CATALOGUES = "blender_assets.cats.txt"
CATALOGUES_HEAD = (
    "# This is an Asset Catalog Definition file for Blender.\n"
    "# Empty lines and lines starting with `#` will be ignored.\n"
    "# The first non-ignored line should be the version indicator.\n"
    '# Other lines are of the format "UUID:catalog/path/for/assets:simple catalog name"\n'
    "\nVERSION 1\n\n"
)

# A catalogue has the same identity in every folder, so that folders can be put together.
NAMESPACE = uuid.UUID("4d9b3d0e-6c07-5f0e-9a63-7a1a3b5b2f10")


def catalogue_id(catalogue: str) -> str:
    """UUID of a catalogue by its path, such as "Measured/Metal"."""
    return str(uuid.uuid5(NAMESPACE, catalogue))


def write_catalogues(folder: Path, catalogues: Iterable[str]) -> None:
    """Add catalogues to those of a folder; what is there stays.

    Raises
    ------
    NfmError
        The file cannot be read or written.
    """
    path = folder / CATALOGUES
    try:
        text = path.read_text(encoding="utf-8") if path.exists() else CATALOGUES_HEAD
        known = {line.partition(":")[0] for line in text.splitlines()}
        for catalogue in sorted(_with_parents(catalogues)):
            identity = catalogue_id(catalogue)
            if identity not in known:
                text += f"{identity}:{catalogue}:{catalogue.replace('/', '-')}\n"
        write_atomically(path, [text.encode()])
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise NfmError(
            f"{shown_name(path)}: cannot be written ({reason}); choose another folder"
        ) from error


def write_material(
    path: Path,
    fitted: FittedMaterial,
    icon: np.ndarray,
    metadata: assets.Metadata,
    sampling: str = DEFAULT_SAMPLING,
) -> None:
    """Write a .blend that holds one material as an asset, all or nothing.

    icon, metadata : as in assets.mark
    sampling : an identifier of properties.SAMPLING_ITEMS

    Raises
    ------
    NfmError
        The file cannot be written, or this Blender cannot compile the shader.
    """
    with _free_name(fitted.name):
        new = material.build(fitted, sampling)
        try:
            assets.mark(new, icon, metadata)
            if metadata.catalogue:
                new.asset_data.catalog_id = catalogue_id(metadata.catalogue)
            _write(path, new)
        finally:
            material.remove(new)


def read_picture(path: Path) -> np.ndarray:
    """RGBA (height, width, 4) display values 0..1 of an 8-bit picture, bottom row first.

    Raises
    ------
    NfmError
        The file is missing, or Blender cannot read it.
    """
    try:
        image = bpy.data.images.load(str(path))
    except RuntimeError:
        raise NfmError(f"{shown_name(path)}: no such picture; install the add-on again") from None
    try:
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, 4)
    finally:
        bpy.data.images.remove(image)


def _with_parents(catalogues: Iterable[str]) -> set[str]:
    found = set()
    for catalogue in catalogues:
        parts = catalogue.split("/")
        found |= {"/".join(parts[: n + 1]) for n in range(len(parts))}
    return found


def _write(path: Path, item: bpy.types.Material) -> None:
    with written_beside(path) as partial:
        bpy.data.libraries.write(str(partial), {item}, fake_user=True, compress=True)


@contextmanager
def _free_name(name: str) -> Iterator[None]:
    """Have a name free for a while: an asset is called as its datablock in its file is."""
    holder = next((m for m in bpy.data.materials if m.name == name and not m.library), None)
    if holder:
        holder.name = f"{name[:40]} {secrets.token_hex(4)}"
    try:
        yield
    finally:
        if holder:
            holder.name = name
