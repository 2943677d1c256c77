# SPDX-License-Identifier: GPL-3.0-or-later
"""The tensor files of Mitsuba and of the RGL material database: named arrays in one file.

Layout, little endian: 12 bytes "tensor_file" and a null; 2 bytes version, 1 and 0; uint32 number
of fields. Then for each field: uint16 length of its name, the name, uint16 number of dimensions,
uint8 type, uint64 offset of its data from the file's beginning, and a uint64 for each dimension.
The data are anywhere behind, the last dimension fastest.

Nothing that a file says about itself is believed: every size is compared with what the file really
holds before anything is allocated for it, so a reader never needs more than about the file's size.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from ..errors import MeasurementError, printable
from .measured_file import MeasuredFile

MAGIC = b"tensor_file\0"
VERSION = (1, 0)

# The number of a type is its place in Mitsuba's Struct::Type, which begins with an invalid one.
DTYPES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")

# More than any published file has; beyond that a file is not what it pretends to be.
MAX_FIELDS = 64
MAX_DIMENSIONS = 8
MAX_SIZE = 1 << 31

EXPECTED = "an RGL .bsdf file"


@dataclass
class _Cursor:
    """Reads numbers from the beginning of a file's bytes; the name is for messages."""

    content: memoryview
    name: str
    position: int = 0

    def bytes(self, count: int) -> bytes:
        """The next bytes."""
        end = self.position + count
        if end > len(self.content):
            raise MeasurementError(
                f"{self.name}: {len(self.content):,} bytes, cut off in its list of fields; "
                "download it again"
            )
        start, self.position = self.position, end
        return bytes(self.content[start:end])

    def number(self, kind: str) -> int:
        """The next unsigned number: B, H, I or Q of the module struct."""
        return struct.unpack(f"<{kind}", self.bytes(struct.calcsize(f"<{kind}")))[0]


def recognises(head: bytes) -> bool:
    """Whether a file starts like a tensor file."""
    return head.startswith(MAGIC)


def read_content(file: MeasuredFile) -> bytes:
    """All bytes of a file of a size that a tensor file can have.

    Raises
    ------
    MeasurementError
        It is larger, or becomes shorter while it is read.
    """
    if file.size > MAX_SIZE:
        raise MeasurementError(
            f"{file.name}: {file.size:,} bytes, expected at most {MAX_SIZE:,}; choose {EXPECTED}"
        )
    content = file.stream.read(file.size)
    if len(content) != file.size:
        raise MeasurementError(f"{file.name}: became shorter while it was read; try again")
    return content


def parse(content: bytes, name: str) -> dict[str, np.ndarray]:
    """Fields of a tensor file: views into its bytes, read-only.

    name : of the file, for messages

    Raises
    ------
    MeasurementError
        The bytes are not a tensor file, or a field is not as the list of fields says.
    """
    cursor = _Cursor(memoryview(content), name)
    if not recognises(content):
        raise MeasurementError(f"{name}: does not begin as a tensor file does; choose {EXPECTED}")
    cursor.bytes(len(MAGIC))
    version = cursor.number("B"), cursor.number("B")
    if version != VERSION:
        raise MeasurementError(
            f"{name}: version {version[0]}.{version[1]} of the tensor format, only "
            f"{VERSION[0]}.{VERSION[1]} can be read; choose {EXPECTED}"
        )
    n_fields = cursor.number("I")
    if n_fields > MAX_FIELDS:
        raise MeasurementError(
            f"{name}: {n_fields:,} fields, expected at most {MAX_FIELDS}; choose {EXPECTED}"
        )
    return dict(_field(cursor) for _ in range(n_fields))


def _field(cursor: _Cursor) -> tuple[str, np.ndarray]:
    field = cursor.bytes(cursor.number("H")).decode("utf-8", errors="replace")
    shown = f'{cursor.name}: field "{printable(field[:40])}"'
    n_dimensions, kind, offset = (cursor.number(k) for k in "HBQ")
    if n_dimensions > MAX_DIMENSIONS:
        raise MeasurementError(
            f"{shown} has {n_dimensions} dimensions, expected at most {MAX_DIMENSIONS}; "
            f"choose {EXPECTED}"
        )
    if not 1 <= kind <= len(DTYPES):
        raise MeasurementError(f"{shown} is of the unknown type {kind}; choose {EXPECTED}")
    # Python's own numbers: their product cannot overflow
    shape = tuple(cursor.number("Q") for _ in range(n_dimensions))
    dtype = np.dtype(DTYPES[kind - 1])
    count = math.prod(shape)
    if offset + count * dtype.itemsize > len(cursor.content):
        raise MeasurementError(
            f"{shown} of {count * dtype.itemsize:,} bytes at {offset:,} reaches beyond the end of "
            f"the file at {len(cursor.content):,}; download it again"
        )
    if count == 0:
        # a shape may hold 0 beside numbers that no array can have
        raise MeasurementError(f"{shown} is empty; download the file again")
    return field, np.frombuffer(cursor.content, dtype, count, offset).reshape(shape)
