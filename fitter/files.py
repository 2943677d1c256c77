# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing files so that an interruption leaves the old one intact."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from pathlib import Path


def write_atomically(target: Path, chunks: Iterable[bytes | memoryview]) -> None:
    """Write a complete file, then put it in place of `target`; on failure nothing changes.

    The temporary file stands in the same folder, because only there is replacing atomic.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    temporary = target.with_name(f".nfm-{secrets.token_hex(8)}.tmp")
    try:
        with temporary.open("xb") as file:
            for chunk in chunks:
                file.write(chunk)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
