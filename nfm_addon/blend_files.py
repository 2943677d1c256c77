# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing .blend files, all or nothing."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..fitter.errors import NfmError, shown_name


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside this one to write to; what was written takes its place at the end.

    Raises
    ------
    NfmError
        It cannot be written; an existing file is then kept, and nothing is left beside it.
    """
    partial = path.with_name(f".nfm-{secrets.token_hex(8)}.blend")
    try:
        yield partial
        partial.replace(path)
    except (OSError, RuntimeError) as error:
        # what Blender says has its own path in it, on several lines
        reason = getattr(error, "strerror", None) or "see Blender's console"
        raise NfmError(
            f"{shown_name(path)}: cannot be written ({reason}); choose another folder"
        ) from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
