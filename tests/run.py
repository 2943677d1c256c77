# SPDX-License-Identifier: GPL-3.0-or-later
"""The tests inside a full Blender: blender -b --factory-startup --python tests/run.py [-- ARGS].

ARGS are pytest's; without any, all tests run. The exit status is pytest's. Settings and extensions
of the user are not touched. In a Blender without OSL, tests that need it are skipped.

Blender's Python has no pytest. It is taken from the folder NFM_PYTEST or, where ./nfm has made its
environment, from there: pytest alone, so that the `bpy` and numpy beside it stay out.
"""

import os
import sys
import traceback
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import find_spec
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent

# pytest and what it imports: Python without compiled parts, so that any version can take it.
PACKAGES = ("pytest", "_pytest", "py", "pluggy", "iniconfig", "packaging", "pygments")

FAILED = 1
MISSING = """\
tests/run.py: there is no pytest for Blender's Python. Do one of these and start again:
- run ./nfm test --version once: it makes an environment with pytest, which is then found;
- install it into a folder, and name that folder:
    python3 -m pip install --target /tmp/nfm-pytest pytest
    NFM_PYTEST=/tmp/nfm-pytest blender -b --factory-startup --python tests/run.py"""


class Borrowed:
    """Finds the packages of pytest in a folder, and nothing else there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """As importlib asks for it."""
        return PathFinder.find_spec(name, [str(self.folder)]) if name in PACKAGES else None


def make_pytest_importable() -> bool:
    """Tell whether there is one."""
    if find_spec("pytest"):
        return True
    home = Path(os.environ.get("NFM_HOME") or CHECKOUT / ".nfm")
    named = os.environ.get("NFM_PYTEST")
    folders = [Path(named)] if named else sorted(home.glob("python*/lib/python*/site-packages"))
    for folder in folders:
        if (folder / "pytest").is_dir():
            sys.meta_path.append(Borrowed(folder))
            return True
    return False


def main(arguments: list[str]) -> int:
    """Run pytest; its exit status."""
    if not make_pytest_importable():
        sys.stderr.write(f"{MISSING}\n")
        return FAILED
    import pytest

    os.chdir(CHECKOUT)  # where pytest finds its settings
    return int(pytest.main(["-p", "no:cacheprovider", *arguments]))


def own_arguments(argv: list[str]) -> list[str]:
    """Those that Blender leaves to scripts: what comes after --."""
    return argv[argv.index("--") + 1 :] if "--" in argv else []


if __name__ == "__main__":
    try:
        STATUS = main(own_arguments(sys.argv))
    except Exception:  # Blender would print it and end with 0
        traceback.print_exc()
        STATUS = FAILED
    sys.exit(STATUS)
