# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats of files, as Blender's file browser and drag and drop see them."""

from ..fitter import parameter_file, readers
from ..fitter.errors import MeasurementError
from ..fitter.fit_file import is_parameter_file

SUFFIXES = (*readers.SUFFIXES, parameter_file.SUFFIX)
FILE_FILTER = ";".join(f"*{suffix}" for suffix in SUFFIXES)

# Blender compares what follows the last dot.
DROPPED_SUFFIXES = ";".join(dict.fromkeys(f".{suffix.rpartition('.')[2]}" for suffix in SUFFIXES))


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
