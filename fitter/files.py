# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing files so that an interruption leaves the old one intact."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

# Names of files that are being written: hidden, and nobody else's.
TEMPORARY = ".nfm-{}.tmp"
ABANDONED = 24 * 3600  # seconds after which nobody writes one any more


def temporary_beside(target: Path) -> Path:
    """A new name in the folder of `target`, because only there is replacing atomic.

    Those that processes left there which were killed while they wrote are removed, once they are a
    day old.
    """
    forgotten = time.time() - ABANDONED
    with suppress(OSError):
        for left in target.parent.glob(TEMPORARY.format("[0-9a-f]" * 16)):
            # one by one: others may be at it too
            with suppress(OSError):
                if left.stat().st_mtime < forgotten:
                    left.unlink()
    return target.with_name(TEMPORARY.format(secrets.token_hex(8)))


def write_atomically(target: Path, chunks: Iterable[bytes | memoryview]) -> None:
    """Write a complete file, then put it in place of `target`; on failure nothing changes.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    temporary = temporary_beside(target)
    try:
        with temporary.open("xb") as file:
            for chunk in chunks:
                file.write(chunk)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
