"""./nfm itself, among interpreters that are shell scripts."""

import shutil
import stat
import subprocess
from pathlib import Path

import pytest

from runner.environment import CHECKOUT


class Machine:
    """A PATH with nothing on it but what a test puts there."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.bin = folder / "bin"
        self.variables = {"PATH": str(self.bin), "NFM_HOME": str(folder / "home")}
        for tool in ("sh", "dirname", "readlink"):
            self.bin.mkdir(exist_ok=True)
            (self.bin / tool).symlink_to(shutil.which(tool))

    def add_script(self, path: str, body: str) -> Path:
        script = self.folder / path
        script.parent.mkdir(parents=True, exist_ok=True)
        script.write_text(f"#!/bin/sh\n{body}\n")
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        return script

    def add_python(self, path: str, version: str, implementation: str = "cpython") -> Path:
        """Add what answers the probe like an interpreter and otherwise tells how it was called."""
        return self.add_script(
            path,
            f'[ "$1" = -I ] && {{ echo "{implementation} {version}"; exit; }}\n'
            'echo "$PWD|$PYTHONPATH|$NFM_BLENDER"; printf "<%s>" "$@"; exit 7',
        )

    def nfm(self, *arguments: str, cwd: Path | None = None, **variables: str):
        return subprocess.run(
            [CHECKOUT / "nfm", *arguments],
            env=self.variables | variables,
            cwd=cwd or self.folder,
            capture_output=True,
            text=True,
        )

    def which(self, *options: str, **variables: str) -> str:
        return self.nfm(*options, "--which", **variables).stdout.strip()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_prefers_3_13(machine):
    machine.add_python("bin/python3.11", "3.11")
    newer = machine.add_python("bin/python3.13", "3.13")
    assert machine.which() == str(newer)


def test_a_shim_that_does_not_run_is_no_interpreter(machine):
    machine.add_script("bin/python3.13", "echo 'pyenv: command not found' >&2; exit 127")
    older = machine.add_python("bin/python3.11", "3.11")
    assert machine.which() == str(older)


def test_a_name_is_not_believed(machine):
    machine.add_python("bin/python3.13", "3.12")
    found = machine.add_python("bin/python", "3.13")
    assert machine.which() == str(found)


@pytest.mark.parametrize(
    ("version", "implementation"), [("3.13", "pypy"), ("3.13t", "cpython"), ("3.12", "cpython")]
)
def test_interpreters_without_a_wheel_are_refused(machine, version, implementation):
    machine.add_python("bin/python3.13", version, implementation)
    assert machine.nfm("--which").returncode == 1


def test_looks_behind_a_broken_shim_of_the_same_name(machine):
    machine.add_script("shims/python3.13", "exit 127")
    working = machine.add_python("real one/python3.13", "3.13")
    path = f"{machine.folder}/shims:{machine.folder}/real one:{machine.bin}"
    assert machine.which(PATH=path) == str(working)


def test_finds_what_only_pyenv_knows(machine):
    machine.add_script(
        "bin/pyenv",
        f'[ "$1" = root ] && echo "{machine.folder}/pyenv" || printf "3.11.7\\n3.13.0\\n"',
    )
    machine.add_python("pyenv/versions/3.11.7/bin/python", "3.11")
    newer = machine.add_python("pyenv/versions/3.13.0/bin/python", "3.13")
    assert machine.which() == str(newer)


def test_a_finished_environment_comes_first(machine):
    machine.add_python("bin/python3.13", "3.13")
    own = machine.add_python("home/python3.13/bin/python", "3.13")
    assert machine.which() != str(own), "unfinished"
    (own.parent.parent / "stamp").touch()
    assert machine.which() == str(own)


def test_relative_home_is_the_callers(machine):
    own = machine.add_python("here/python3.13/bin/python", "3.13")
    (own.parent.parent / "stamp").touch()
    assert machine.which(NFM_HOME="here") == str(own)


@pytest.mark.parametrize(
    "how", [["--blender", "4.5"], ["--blender=4.5"], {"NFM_BLENDER": "4.5"}], ids=str
)
def test_blender_version_selects_the_interpreter(machine, how):
    machine.add_python("bin/python3.13", "3.13")
    older = machine.add_python("bin/python3.11", "3.11")
    options, variables = ([], how) if isinstance(how, dict) else (how, {})
    assert machine.which(*options, **variables) == str(older)


def test_option_wins_over_variable(machine):
    newer = machine.add_python("bin/python3.13", "3.13")
    assert machine.which("--blender", "5.2", NFM_BLENDER="4.5") == str(newer)


@pytest.mark.parametrize("arguments", [["--blender", "3.6", "test"], ["--blender"]])
def test_unknown_blender_is_bad_usage(machine, arguments):
    machine.add_python("bin/python3.13", "3.13")
    assert machine.nfm(*arguments).returncode == 2


def test_no_python_names_the_apt_line(machine):
    answer = machine.nfm("python")
    assert answer.returncode == 1
    assert "apt-get install python3 python3-venv" in answer.stderr
    assert answer.stdout == ""


def test_other_version_only_names_that_one(machine):
    machine.add_python("bin/python3.11", "3.11")
    answer = machine.nfm("--blender", "5.2", "python")
    assert answer.returncode == 1
    assert "apt-get install python3.13 python3.13-venv" in answer.stderr


def test_hands_over_arguments_folder_and_status(machine):
    machine.add_python("bin/python3.13", "3.13")
    cwd = machine.folder / "some where"
    cwd.mkdir()
    answer = machine.nfm(
        "--blender", "5.2", "fit", "a b", "", "--blender", "*", cwd=cwd, PYTHONPATH="/theirs"
    )
    assert answer.returncode == 7
    where, arguments = answer.stdout.splitlines()
    assert where == f"{cwd}|{CHECKOUT}:/theirs|5.2"
    assert arguments == "<-P><-m><runner><fit><a b><><--blender><*>"


def test_works_through_a_link(machine):
    machine.add_python("bin/python3.13", "3.13")
    (machine.bin / "nfm").symlink_to(CHECKOUT / "nfm")
    answer = subprocess.run(["nfm", "fit"], env=machine.variables, capture_output=True, text=True)
    assert f"|{CHECKOUT}" in answer.stdout
