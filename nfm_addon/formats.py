# SPDX-License-Identifier: GPL-3.0-or-later
"""The suffixes that Blender's file browser and drag and drop look for."""

from ..fitter import parameter_file, readers

SUFFIXES = (*readers.SUFFIXES, parameter_file.SUFFIX)
FILE_FILTER = ";".join(f"*{suffix}" for suffix in SUFFIXES)

# Blender compares what follows the last dot.
DROPPED_SUFFIXES = ";".join(dict.fromkeys(f".{suffix.rpartition('.')[2]}" for suffix in SUFFIXES))
