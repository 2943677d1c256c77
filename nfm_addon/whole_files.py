# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that Blender itself writes, all or nothing.

Blender does not say when a disk is full while it writes a picture, and leaves half of it. So it
writes beside, and what is there takes the place of the old file only if it is whole.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..fitter.errors import NfmError, shown_name
from ..fitter.files import temporary_beside

PNG_START = b"\x89PNG\r\n\x1a\n"
PNG_END = b"IEND\xaeB`\x82"
EXR_START = b"v/1\x01"
# Rows in a chunk of the compressions that have more than one, by their number in the file.
EXR_ROWS = {3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}


@contextmanager
def written_beside(target: Path) -> Iterator[Path]:
    """A path in the same folder for Blender to write to; what is there then replaces `target`.

    Raises
    ------
    NfmError
        Nothing was written, or half of it; an existing file is kept.
    """
    name = shown_name(target)
    partial = temporary_beside(target)
    try:
        yield partial
        if not partial.is_file():
            raise NfmError(f"{name}: Blender wrote no file; see its console")
        if not is_whole(partial):
            raise NfmError(f"{name}: only a part of it could be written; is the disk full?")
        partial.replace(target)
    except (OSError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and partial.name not in str(error):
            raise  # not about this file
        # what Blender says has its own path in it, on several lines
        reason = getattr(error, "strerror", None) or "see Blender's console"
        raise NfmError(f"{name}: cannot be written ({reason}); choose another folder") from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def is_whole(path: Path) -> bool:
    """Whether a PNG, or an EXR of one part, goes on to its end; other files are not empty."""
    content = path.read_bytes()
    if content.startswith(PNG_START):
        return content.endswith(PNG_END)
    if not content.startswith(EXR_START):
        return bool(content)
    try:
        return _is_whole_exr(content)
    except (struct.error, IndexError, KeyError, ValueError):
        return False


def _is_whole_exr(content: bytes) -> bool:
    """Whether the last chunk, of those that the header promises, is all there.

    File layout: openexr.com/en/latest/OpenEXRFileLayout.html. The table of offsets is written last.
    """
    place, attributes = 8, {}
    while content[place] != 0:
        name, kind_at = _text(content, place)
        _, size_at = _text(content, kind_at)
        (size,) = struct.unpack_from("<i", content, size_at)
        attributes[name] = content[size_at + 4 : size_at + 4 + size]
        place = size_at + 4 + size
    _, low, _, high = struct.unpack("<4i", attributes[b"dataWindow"])
    rows = EXR_ROWS.get(attributes[b"compression"][0], 1)
    count = -((low - high - 1) // rows)
    offsets = struct.unpack_from(f"<{count}Q", content, place + 1)
    last = max(offsets)
    _, size = struct.unpack_from("<ii", content, last)
    return min(offsets) > place and last + 8 + size <= len(content)


def _text(content: bytes, place: int) -> tuple[bytes, int]:
    """Text that ends with a zero, and where the next begins."""
    end = content.index(0, place)
    return content[place:end], end + 1
