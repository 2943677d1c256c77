# SPDX-License-Identifier: GPL-3.0-or-later
"""Files and folders that a person may not read or write, also where root runs the tests."""

import os
import stat
from contextlib import contextmanager

NOBODY = 65534


@contextmanager
def without(path, mode):
    """Give a file or folder a mode, such as 0o555, and be somebody whom it binds: root has all."""
    old = stat.S_IMODE(path.stat().st_mode)
    path.chmod(mode)
    try:
        with _as_nobody(path) if os.geteuid() == 0 else _as_ever():
            yield
    finally:
        path.chmod(old)


@contextmanager
def _as_nobody(path):
    """The folders that pytest keeps its files in are closed to others; open them meanwhile."""
    above = {folder: stat.S_IMODE(folder.stat().st_mode) for folder in path.parents}
    for folder, mode in above.items():
        if not mode & 0o001:
            folder.chmod(mode | 0o111)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        for folder, mode in above.items():
            if not mode & 0o001:
                folder.chmod(mode)


@contextmanager
def _as_ever():
    yield
