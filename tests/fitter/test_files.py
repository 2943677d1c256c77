# SPDX-License-Identifier: GPL-3.0-or-later
"""What a process leaves that is killed while it writes."""

import os
import signal
import subprocess
import sys
import time

import pytest

from fitter import files
from runner.environment import CHECKOUT

KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from fitter.files import write_atomically

def chunks():
    yield b"the first half"
    if sys.argv[3] == "write":
        os.kill(os.getpid(), signal.SIGKILL)

Path.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
write_atomically(Path(sys.argv[1]), chunks())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
@pytest.mark.parametrize("when", ["write", "replace"])
def test_killed_while_writing(tmp_path, when):
    path = tmp_path / "gold.nfm.json"
    path.write_text("old")
    command = [sys.executable, "-c", KILLED, path, CHECKOUT, when]
    assert subprocess.run(command).returncode == -signal.SIGKILL
    assert path.read_text() == "old"
    (left,) = {*tmp_path.iterdir()} - {path}

    # a file that was begun a moment ago may be somebody's
    files.write_atomically(path, [b"new"])
    assert path.read_bytes() == b"new"
    assert left.exists()
    yesterday = time.time() - files.ABANDONED - 60
    os.utime(left, (yesterday, yesterday))
    files.write_atomically(path, [b"newer"])
    assert [*tmp_path.iterdir()] == [path]
    assert path.read_bytes() == b"newer"


def test_files_of_others_are_never_removed(tmp_path):
    others = [
        ".nfm-notes.tmp",
        "nfm-0123456789abcdef.tmp",
        ".nfm-0123456789abcdef.tmp.bak",
        "x.tmp",
    ]
    for name in others:
        (tmp_path / name).write_text("mine")
        os.utime(tmp_path / name, (0, 0))
    files.write_atomically(tmp_path / "new", [b"x"])
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*others, "new"])
