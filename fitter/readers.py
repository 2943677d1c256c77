# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a measured file of any format: the content decides which, not the suffix."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import merl, rgl
from .measured_file import opened
from .measurement import Measurement

# How many bytes of a file a format may look at to recognise it.
HEAD_SIZE = 64


@dataclass(frozen=True)
class Format:
    """A file format.

    name : as in Source.format
    suffixes : that its files usually have, lower case, with the dot
    recognises : whether the first HEAD_SIZE bytes and the size of a file are those of the format
    read : the reader
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes, int], bool]
    read: Callable[[str | os.PathLike], Measurement]


FORMATS = (
    Format("merl", (".binary",), merl.recognises, merl.read),
    Format("rgl", (".bsdf",), rgl.recognises, rgl.read),
)
SUFFIXES = tuple(suffix for format_ in FORMATS for suffix in format_.suffixes)
EXPECTED = f"a measured BRDF ({', '.join(SUFFIXES)})"


def read(path: str | os.PathLike) -> Measurement:
    """Read a measured file.

    Raises
    ------
    MeasurementError
        The file cannot be read, is of no known format, or holds nothing to fit.
    """
    return detect(path).read(path)


def detect(path: str | os.PathLike) -> Format:
    """Format of a file, by its content; where none fits, the one whose suffix it has.

    The reader of that format then says what is wrong with the file.

    Raises
    ------
    MeasurementError
        The file cannot be read.
    """
    with opened(path, EXPECTED) as file:
        head = file.stream.read(HEAD_SIZE)
        for format_ in FORMATS:
            if format_.recognises(head, file.size):
                return format_
    suffix = Path(os.fsdecode(path)).suffix.lower()
    return next((format_ for format_ in FORMATS if suffix in format_.suffixes), FORMATS[0])
