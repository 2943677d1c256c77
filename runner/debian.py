"""Debian packages: name the ones that are missing, install them where that is allowed.

Imports only what Debian's python3.x-minimal package has: this module is what completes it.
"""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterable

from .messages import SetupError, say

# Debian ships these apart from the interpreter; python3.x-venv pulls in all of them.
SEPARATE_MODULES = ("ensurepip", "venv", "tomllib", "json", "fcntl")

APT_GET = "/usr/bin/apt-get"


def require_whole_python() -> None:
    """Install the parts of the standard library Debian left out, and start again with them."""
    missing = [name for name in SEPARATE_MODULES if importlib.util.find_spec(name) is None]
    if missing:
        package = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        install([package], f"{sys.executable} lacks {', '.join(missing)}")
        os.execv(sys.executable, sys.orig_argv)


def install(packages: Iterable[str], lacking: str) -> None:
    """Install packages with apt as root; anyone else is told the line that does it.

    Parameters
    ----------
    packages
        Debian package names.
    lacking
        What is missing and why it is needed, a sentence without its full stop.
    """
    names = sorted(set(packages))
    line = f"apt-get install {' '.join(names)}"
    if os.geteuid() != 0 or not os.access(APT_GET, os.X_OK):
        raise SetupError(f"{lacking}. On Debian, install it as root with\n  {line}")
    say(f"{lacking}; installing: {line}")
    # An update may fail for one source that has nothing to do with us, so only install counts.
    _apt_get("update")
    outcome = _apt_get("install", "--yes", "--no-install-recommends", *names)
    if outcome.returncode != 0:
        raise SetupError(f"{lacking}, and this failed:\n  {line}\n{outcome.stdout.strip()}")


def _apt_get(*arguments: str) -> subprocess.CompletedProcess:
    # Kept back: the many lines of an install are only of interest when it fails.
    return subprocess.run(
        [APT_GET, "-qq", *arguments],
        env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
