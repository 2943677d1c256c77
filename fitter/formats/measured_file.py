# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening and writing measured files: what the readers of all formats have in common.

Files come from strangers. A path may be a folder, a pipe or a device, may not exist or not be
readable; each of these is an error that names the file, and none of them waits.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ..errors import MeasurementError, shown_name
from ..files import write_atomically


@dataclass(frozen=True)
class MeasuredFile:
    """An open regular file.

    name : for messages
    stored_name : without folders, text that any UTF-8 file can hold
    size : bytes
    """

    stream: BinaryIO
    name: str
    stored_name: str
    size: int


@contextmanager
def opened(path: str | os.PathLike, expected: str) -> Iterator[MeasuredFile]:
    """Open a measured file to read.

    expected : what to choose instead if it is no file at all, such as "a MERL .binary file"

    Raises
    ------
    MeasurementError
        There is no such file, or it cannot be read; also for an OSError while it is open.
    """
    name = checked_name(path)
    try:
        with open(path, "rb", opener=_open_without_waiting) as stream:
            status = os.fstat(stream.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise _not_a_file(name, "a pipe or device", expected)
            yield MeasuredFile(stream, name, _storable_name(path), status.st_size)
    except IsADirectoryError:
        raise _not_a_file(name, "a folder", expected) from None
    except FileNotFoundError:
        raise MeasurementError(f"{name}: no such file; check the path") from None
    except OSError as error:
        raise MeasurementError(
            f"{name}: cannot be read ({error.strerror or error}); check its permissions"
        ) from error


def write(path: str | os.PathLike, chunks: Iterable[bytes | memoryview], expected: str) -> None:
    """Write a file, all or nothing: an existing one is replaced by a complete one or kept.

    expected : what to choose instead if the target is no file, as for `opened`

    Raises
    ------
    MeasurementError
        The file cannot be written.
    """
    name = checked_name(path)
    try:
        target = Path(os.fsdecode(path))
        if target.exists() and not target.is_file():
            raise _not_a_file(name, "something else", expected)
        write_atomically(target, chunks)
    except OSError as error:
        raise MeasurementError(
            f"{name}: cannot be written ({error.strerror or error}); choose another folder"
        ) from error


def checked_name(path: str | os.PathLike) -> str:
    """Name for messages; Python refuses null characters with an error of its own."""
    name = shown_name(path)
    if "\0" in os.fsdecode(path):
        raise MeasurementError(f"{name}: a file name cannot hold a null character; rename it")
    return name


def _open_without_waiting(path: str, flags: int) -> int:
    """Open, but do not wait for the other end of a named pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _not_a_file(name: str, found: str, expected: str) -> MeasurementError:
    return MeasurementError(f"{name}: {found}, not a regular file; choose {expected}")


def _storable_name(path: str | os.PathLike) -> str:
    """Name without folders that any UTF-8 text can hold; other bytes become U+FFFD."""
    return os.fsencode(Path(os.fsdecode(path)).name).decode("utf-8", errors="replace")
