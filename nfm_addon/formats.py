# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats of files, as Blender's file browser and drag and drop see them."""

from __future__ import annotations

import os
from pathlib import Path

import bpy

from ..fitter.errors import MeasurementError
from ..fitter.formats import parameter_file, readers
from ..fitter.jobs.fit_file import is_parameter_file

SUFFIXES = (*readers.SUFFIXES, parameter_file.SUFFIX)
FILE_FILTER = ";".join(f"*{suffix}" for suffix in SUFFIXES)

# Blender compares what follows the last dot.
DROPPED_SUFFIXES = ";".join(dict.fromkeys(f".{suffix.rpartition('.')[2]}" for suffix in SUFFIXES))


def chosen(context: bpy.types.Context) -> str:
    """Path of the file chosen in a file browser, which tells its operator only at the end."""
    space = context.space_data
    if space is None or space.type != "FILE_BROWSER" or space.params is None:
        return ""
    return str(Path(os.fsdecode(space.params.directory), space.params.filename))


def name_of(path: str) -> str:
    """Name of a file's format, by its content; empty where no file can be read."""
    if is_parameter_file(path):
        return "NFM"
    try:
        return readers.detect(path).name.upper()
    except MeasurementError:
        return ""


def has_encodings(path: str) -> bool:
    """Whether the numbers of a file can be taken in several ways, as far as one can tell."""
    if is_parameter_file(path):
        return False
    try:
        return bool(readers.detect(path).encodings)
    except MeasurementError:
        return True
