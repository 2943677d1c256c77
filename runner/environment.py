"""The private environment: a venv with what pyproject.toml pins, made once.

A stamp in the venv's folder lists the requirements installed there. It is removed before pip
starts and written after pip has ended, so an interrupted install has none, and changed pins
differ from it. Either way the environment is made again.
"""

import contextlib
import json
import os
import platform
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from .messages import SetupError, say

CHECKOUT = Path(__file__).resolve().parent.parent

ALWAYS = ("dependencies", "test")  # pip groups every environment has

Requirements = dict[str, list[str]]


def folder() -> Path:
    """Return where the environment of the running Python version is kept."""
    home = Path(os.environ.get("NFM_HOME") or CHECKOUT / ".nfm")
    return home / f"python{sys.version_info.major}.{sys.version_info.minor}"


def ensure(extras: Iterable[str] = (), checkout: Path = CHECKOUT) -> Path:
    """Make the environment ready and return its interpreter; quick and silent when it is.

    Parameters
    ----------
    extras
        Optional dependencies of pyproject.toml wanted besides `test`.
    """
    environment = folder()
    python = environment / "bin" / "python"
    pins = read_requirements(checkout / "pyproject.toml")
    groups = list(dict.fromkeys((*ALWAYS, *extras)))
    wanted = {group: pins[group] for group in groups}
    if is_ready(environment, wanted):
        return python

    environment.mkdir(parents=True, exist_ok=True)
    with _locked(environment.with_suffix(environment.suffix + ".lock")):
        # Another ./nfm may have done it while this one waited.
        if not is_ready(environment, wanted):
            _install(environment, python, wanted)
    return python


def read_requirements(pyproject: Path) -> Requirements:
    """Return the requirement lines of pyproject.toml: `dependencies` and one group per extra."""
    project = tomllib.loads(pyproject.read_text(encoding="utf-8"))["project"]
    return {"dependencies": project["dependencies"], **project.get("optional-dependencies", {})}


def is_ready(environment: Path, wanted: Requirements) -> bool:
    """Tell whether a finished install of every wanted group, for this Python, is there."""
    # A link whose interpreter was removed does not exist.
    if not (environment / "bin" / "python").exists():
        return False
    installed = _read_stamp(environment)
    return all(installed.get(group) == lines for group, lines in wanted.items())


def _install(environment: Path, python: Path, wanted: Requirements) -> None:
    installed = _read_stamp(environment)
    keeps = is_ready(environment, {group: wanted[group] for group in ALWAYS})
    _stamp_path(environment).unlink(missing_ok=True)
    if keeps:
        # Only an extra is new. The pins go along, so that pip does not move them for it.
        wanted = installed | wanted
    else:
        say(f"making the private environment {environment} (once, takes about a minute)")
        # Not sys.executable: that may be the very link the new venv replaces.
        _run("making a venv", sys._base_executable, "-I", "-m", "venv", "--clear", environment)

    lines = [line for group in wanted.values() for line in group]
    say(f"installing from pyproject.toml: {', '.join(wanted)}")
    verbosity = () if sys.stderr.isatty() else ("--quiet",)
    # -I: pip must not take a package on the caller's PYTHONPATH for one that is installed.
    pip = (python, "-I", "-m", "pip", "--disable-pip-version-check", "--no-input", *verbosity)
    _run("pip", *pip, "install", *lines)
    _write_stamp(environment, wanted)


def _run(name: str, *command: str | Path) -> None:
    # 2 is stderr: what pip prints must not mix with a verb's output.
    if subprocess.run(command, stdout=2).returncode != 0:
        raise SetupError(f"{name} failed (see above); the next ./nfm starts over")


def _stamp_path(environment: Path) -> Path:
    return environment / "stamp"  # ./nfm looks for it too


def _read_stamp(environment: Path) -> Requirements:
    try:
        stamp = json.loads(_stamp_path(environment).read_text(encoding="utf-8"))
    except (FileNotFoundError, json.JSONDecodeError):
        return {}
    return stamp["installed"] if stamp["interpreter"] == _interpreter() else {}


def _write_stamp(environment: Path, installed: Requirements) -> None:
    stamp = {"interpreter": _interpreter(), "installed": installed}
    _stamp_path(environment).write_text(json.dumps(stamp, indent=1), encoding="utf-8")


def _interpreter() -> str:
    # Wheels fit a minor version, so a patch release does not cost a new environment.
    return f"{sys.implementation.cache_tag} {platform.machine()}"


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock that ends with this process, however it ends."""
    import fcntl  # not there on Windows, where the tests import this module too

    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("waiting for another ./nfm that prepares the same environment")
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
