# SPDX-License-Identifier: GPL-3.0-or-later
"""The material library: shipped as parameter files and pictures, installed as an asset library.

A .blend of all materials would be many times as large, would hold the bytecode of one version of
OSL, and would vanish with the next update of the add-on under materials that link to it. So the
assets are made on the user's machine, in the add-on's own folder, when the user asks for it.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import bpy

from .. import __package__ as base_package
from ..fitter.errors import NfmError
from ..fitter.formats import parameter_file
from ..fitter.jobs import library
from ..fitter.jobs.library import Entry
from . import asset_files
from .assets import Metadata

NAME = "Measured Materials"

SHIPPED = Path(__file__).resolve().parents[1] / "library"


def parameters_of(entry: Entry, folder: Path = SHIPPED) -> Path:
    """The parameter file of an entry."""
    return folder / f"{entry.key}{parameter_file.SUFFIX}"


def picture_of(entry: Entry, folder: Path = SHIPPED) -> Path:
    """The preview of an entry."""
    return folder / f"{entry.key}.png"


def installed_folder() -> Path:
    """Where the assets are, once they are installed."""
    return Path(bpy.utils.extension_path_user(base_package, path="library"))


def registered() -> bpy.types.UserAssetLibrary | None:
    """The library among the user's asset libraries."""
    return _registered(installed_folder())


def install() -> Iterator[tuple[int, int]]:
    """Make the assets and register their folder; yields (done, all) after each material.

    Raises
    ------
    NfmError
        A file cannot be read or written, or this Blender cannot compile a shader.
    """
    folder = installed_folder()
    _make(folder)
    entries = library.ENTRIES
    asset_files.write_catalogues(folder, {entry.catalogue for entry in entries})
    for number, entry in enumerate(entries):
        metadata = Metadata(
            description=entry.description,
            catalogue=entry.catalogue,
            author=entry.author,
            license=library.LICENSE,
            tags=entry.tags,
        )
        asset_files.write_material(
            folder / f"{entry.key}.blend",
            parameter_file.load(parameters_of(entry)),
            asset_files.read_picture(picture_of(entry)),
            metadata,
        )
        yield number + 1, len(entries)
    register_folder(folder, NAME)


def remove() -> None:
    """Take the library out of the preferences and delete its files.

    Raises
    ------
    NfmError
        They cannot be deleted.
    """
    folder = installed_folder()
    if entry := _registered(folder):
        bpy.context.preferences.filepaths.asset_libraries.remove(entry)
        bpy.context.preferences.is_dirty = True
    try:
        if folder.is_dir():
            shutil.rmtree(folder)
    except OSError as error:
        raise NfmError(
            f"{folder.name}: cannot be deleted ({error.strerror or error}); close what uses it"
        ) from error


def register_folder(folder: Path, name: str) -> None:
    """Show a folder in the asset browser, unless it is there already."""
    if _registered(folder):
        return
    entry = bpy.context.preferences.filepaths.asset_libraries.new(name=name, directory=str(folder))
    # A material is there to be edited, which a linked or packed one cannot be; and what is dropped
    # again is as measured again.
    entry.import_method = "APPEND"
    bpy.context.preferences.is_dirty = True


def _registered(folder: Path) -> bpy.types.UserAssetLibrary | None:
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((entry for entry in libraries if Path(entry.path) == folder), None)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise NfmError(
            f"{folder.name}: cannot be made a folder ({error.strerror or error}); "
            "check the permissions of Blender's folder of extensions"
        ) from error
