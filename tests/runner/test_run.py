# SPDX-License-Identifier: GPL-3.0-or-later
"""tests/run.py in a Python that has no packages, as Blender's has no pytest."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from runner.environment import CHECKOUT

# run.py as Blender runs it, then what can be imported
CODE = """
import sys
sys.argv = ["blender", "-b", *sys.argv[1:]]
path = sys.argv[2]
try:
    exec(compile(open(path).read(), path, "exec"), {"__name__": "__main__", "__file__": path})
finally:
    from importlib.util import find_spec
    print("numpy" if find_spec("numpy") else "no numpy")
"""


def run(tmp_path, *arguments, **variables):
    program = [sys.executable, "-I", "-S", "-c", CODE, CHECKOUT / "tests" / "run.py"]
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NFM_", "PYTEST_"))}
    environment |= {"NFM_HOME": str(tmp_path / "none")} | variables
    return subprocess.run(
        [*map(str, program), *arguments], env=environment, capture_output=True, text=True
    )


def test_without_pytest_it_says_how_to_get_one(tmp_path):
    answer = run(tmp_path)
    assert answer.returncode == 1
    assert "pip install --target" in answer.stderr
    assert "NFM_PYTEST=" in answer.stderr
    assert "Traceback" not in answer.stderr


def test_pytest_is_borrowed_and_nothing_else(tmp_path):
    (tmp_path / "test_it.py").write_text(
        "def test_good(): pass\ndef test_bad(): assert False\n", encoding="utf-8"
    )
    folder = str(Path(pytest.__file__).parents[1])
    options = ["-q", "--noconftest", "-c", os.devnull, "--rootdir", str(tmp_path)]
    for name, status in (("test_good", 0), ("test_bad", 1), ("test_none", 5)):
        chosen = ["--", *options, "-k", name, str(tmp_path / "test_it.py")]
        answer = run(tmp_path, *chosen, NFM_PYTEST=folder)
        assert answer.returncode == status, answer.stdout + answer.stderr
        assert "no numpy" in answer.stdout
