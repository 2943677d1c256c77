import os
import signal
import subprocess
import sys

import pytest

from runner.environment import CHECKOUT


@pytest.fixture
def start(tmp_path):
    """Start a verb made of the given code; its arguments are `a` and `b c`."""

    def start(code: str) -> subprocess.Popen:
        (tmp_path / "verb.py").write_text(code)
        return subprocess.Popen(
            [sys.executable, "-P", "-m", "runner.interruptible", "verb", "a", "b c"],
            env=os.environ | {"PYTHONPATH": f"{CHECKOUT}{os.pathsep}{tmp_path}"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # a background job starts with it ignored, and its children with it
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )

    return start


ECHO = "import sys; print(__name__, sys.argv[1:]); sys.exit(3)"


@pytest.mark.parametrize(
    ("code", "status", "out"),
    [("raise KeyboardInterrupt", 130, ""), (ECHO, 3, "__main__ ['a', 'b c']\n"), ("", 0, "")],
)
def test_status_and_output(start, code, status, out):
    verb = start(code)
    assert verb.communicate(timeout=20) == (out, "")
    assert verb.returncode == status


# The second one is C code that lets other threads run but not the signal through, as a render.
@pytest.mark.parametrize(
    "slow",
    ["import time; time.sleep(60)", "import hashlib; hashlib.pbkdf2_hmac('md5', b'', b'', 10**9)"],
    ids=["python", "c"],
)
def test_interrupt(start, slow):
    verb = start(f"print('ready', flush=True)\n{slow}")
    assert verb.stdout.readline() == "ready\n"
    verb.send_signal(signal.SIGINT)
    try:
        assert verb.communicate(timeout=20) == ("", "")
    finally:
        verb.kill()
    assert verb.returncode == 130
