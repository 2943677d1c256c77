import re
import subprocess
import sys
from pathlib import Path

import pytest

from runner import debian, system_libraries
from runner.messages import SetupError

LDD = """\
\tlinux-vdso.so.1 (0x00007f3c7cc55000)
\tlibX11.so.6 => {x11} (0x00007f3c70b63000)
\tlibXi.so.6 => not found
\tlibGL.so.1 => not found
\t/lib64/ld-linux-x86-64.so.2 (0x00007f3c7cc55000)
"""
COMPLETE = "\tlibX11.so.6 => {x11} (0x00007f3c70b63000)\n"
IMPORT_ERROR = "ImportError: libSM.so.6: cannot open shared object file: No such file or directory"
GLIBC = {"libc.so.6", "libdl.so.2", "libm.so.6", "libpthread.so.0", "librt.so.1", "libutil.so.1"}


@pytest.fixture
def python(tmp_path) -> Path:
    (tmp_path / "environment").mkdir()
    return tmp_path / "environment" / "bin" / "python"


@pytest.fixture
def machine(monkeypatch, tmp_path):
    """Answers of ldd and of the import, one after the other; installed packages."""

    class Machine:
        def __init__(self):
            self.listings: list[str] = []
            self.import_errors: list[str] = []
            self.installed: list[set[str]] = []
            self.x11 = tmp_path / "libX11.so.6"
            self.x11.touch()

        def ldd(self, environment):
            listing = self.listings.pop(0) if len(self.listings) > 1 else self.listings[0]
            return listing.format(x11=self.x11)

        def run(self, command, **options):
            error = self.import_errors.pop(0) if self.import_errors else ""
            return subprocess.CompletedProcess(command, bool(error), "", error)

    machine = Machine()
    monkeypatch.setattr(system_libraries, "_ldd", machine.ldd)
    monkeypatch.setattr(system_libraries.subprocess, "run", machine.run)
    monkeypatch.setattr(debian, "install", lambda names, why: machine.installed.append(names))
    return machine


def test_ldd_names_all_that_is_missing(machine, python):
    machine.listings = [LDD]
    assert system_libraries.find_missing(python) == {"libXi.so.6", "libGL.so.1"}


def test_without_ldd_the_import_names_it(machine, python):
    machine.listings = [""]
    machine.import_errors = [IMPORT_ERROR]
    assert system_libraries.find_missing(python) == {"libSM.so.6"}


def test_any_other_import_error_is_shown(machine, python):
    machine.listings = [COMPLETE]
    machine.import_errors = ["ImportError: undefined symbol: foo"]
    with pytest.raises(SetupError, match="undefined symbol: foo"):
        system_libraries.find_missing(python)


def test_installs_until_nothing_is_missing(machine, python, capsys):
    machine.listings = [LDD, COMPLETE]
    machine.import_errors = [IMPORT_ERROR]
    system_libraries.ensure(python)
    assert machine.installed == [{"libxi6", "libgl1"}, {"libsm6"}]
    capsys.readouterr()

    machine.listings = [LDD]  # would be seen, were it asked again
    system_libraries.ensure(python)
    assert capsys.readouterr() == ("", "")


def test_a_library_removed_later_is_noticed(machine, python):
    machine.listings = [COMPLETE]
    system_libraries.ensure(python)
    machine.x11.unlink()
    machine.listings = [LDD, COMPLETE]
    system_libraries.ensure(python)
    assert machine.installed == [{"libxi6", "libgl1"}]


def test_a_package_that_does_not_help_ends_it(machine, python):
    machine.listings = [LDD]
    with pytest.raises(SetupError, match="still does not find libGL"):
        system_libraries.ensure(python)


def test_unknown_library_is_named():
    with pytest.raises(SetupError, match=r"libodd\.so\.3"):
        system_libraries.packages_of({"libXi.so.6", "libodd.so.3"})


def test_table_covers_what_the_installed_bpy_links():
    pytest.importorskip("bpy")
    listing = system_libraries._ldd(Path(sys.prefix))
    linked = set(re.findall(r"(\S+) => /(?!.*site-packages)", listing)) - GLIBC
    assert "libXi.so.6" in linked
    assert linked <= system_libraries.DEBIAN_PACKAGES.keys()
