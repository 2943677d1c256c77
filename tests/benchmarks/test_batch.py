# SPDX-License-Identifier: GPL-3.0-or-later
import subprocess
import sys

import pytest

from benchmarks import batch

HOLDER = """
import subprocess, sys
held = b"x" * 40_000_000
child = ["-c", "held = b'y' * 60_000_000; print('ready', flush=True); input()"]
subprocess.run([sys.executable, *child])
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_memory_of_a_process_and_its_children():
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdin=pipe, stdout=pipe) as process:
        assert process.stdout.readline() == b"ready\n"
        assert 100e6 < batch._memory(process.pid) < 250e6
        process.communicate(b"\n")
    assert batch._memory(process.pid) == 0
