# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a measured file of any format: the content decides which, not the suffix."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..anisotropic_measurement import AnisotropicMeasurement
from ..errors import MeasurementError, printable, shown_name
from ..measurement import Measurement
from . import merl, rgl, utia
from .measured_file import opened

AnyMeasurement = Measurement | AnisotropicMeasurement

# How many bytes of a file a format may look at to recognise it.
HEAD_SIZE = 64


@dataclass(frozen=True)
class Format:
    """A file format.

    name : as in Source.format
    suffixes : that its files usually have, lower case, with the dot
    recognises : whether the first HEAD_SIZE bytes and the size of a file are those of the format
    read : the reader; takes an encoding too where there are any
    encodings : ways to take the file's numbers, the default first
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes, int], bool]
    read: Callable[..., AnyMeasurement]
    encodings: tuple[str, ...] = ()


FORMATS = (
    Format("merl", (".binary",), merl.recognises, merl.read),
    Format("rgl", (".bsdf",), rgl.recognises, rgl.read),
    Format("utia-bin", (".bin",), utia.recognises_bin, utia.read_bin, tuple(utia.ENCODINGS)),
    Format("utia-exr", (".exr",), utia.recognises_exr, utia.read_exr, tuple(utia.ENCODINGS)),
)
SUFFIXES = tuple(suffix for format_ in FORMATS for suffix in format_.suffixes)
EXPECTED = f"a measured BRDF ({', '.join(SUFFIXES)})"


def read(path: str | os.PathLike, *, encoding: str | None = None) -> AnyMeasurement:
    """Read a measured file.

    encoding : one of the format's encodings; None for its default

    Raises
    ------
    MeasurementError
        The file cannot be read, is of no known format, holds nothing to fit, or its format does
        not have that encoding.
    """
    format_ = detect(path)
    if encoding is None:
        return format_.read(path)
    if encoding not in format_.encodings:
        offered = ", ".join(format_.encodings) or "no choice"
        raise MeasurementError(
            f"{shown_name(path)}: encoding {printable(encoding)}, files of the format "
            f"{format_.name} have {offered}; choose another or none"
        )
    return format_.read(path, encoding)


def offered_encoding(path: str | os.PathLike, wanted: str | None) -> str | None:
    """The encoding with which a file among many is read: as wanted where its format has a choice.

    None for files without, whatever is wanted; the format's default where nothing is.

    Raises
    ------
    MeasurementError
        The file cannot be read.
    """
    offered = detect(path).encodings
    return (wanted or offered[0]) if offered else None


def read_isotropic(path: str | os.PathLike) -> Measurement:
    """Read a measured file for what has no use for anisotropic ones.

    Raises
    ------
    MeasurementError
        As `read`, and if the file is anisotropic.
    """
    measurement = read(path)
    if isinstance(measurement, AnisotropicMeasurement):
        raise MeasurementError(
            f"{shown_name(path)}: an anisotropic measurement, only isotropic ones can be used "
            "here; choose another file"
        )
    return measurement


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
