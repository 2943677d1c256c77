import subprocess

import pytest

from runner import debian
from runner.messages import SetupError


@pytest.fixture
def apt(monkeypatch):
    """Pretend to be root beside an apt-get that only takes notes."""
    calls: list[list[str]] = []

    def run(command, **options):
        calls.append(command)
        return subprocess.CompletedProcess(command, run.status, "E: no such package")

    run.status = 0
    run.calls = calls
    monkeypatch.setattr(debian.subprocess, "run", run)
    monkeypatch.setattr(debian, "APT_GET", "/bin/sh")  # any program that is there
    monkeypatch.setattr(debian.os, "geteuid", lambda: 0)
    return run


def test_root_updates_and_installs(apt, capsys):
    debian.install(["libxi6", "libgl1", "libxi6"], "Blender needs them")
    update, install = apt.calls
    assert update[-1] == "update"
    assert install[-2:] == ["libgl1", "libxi6"]
    assert "apt-get install libgl1 libxi6" in capsys.readouterr().err


def test_others_are_told_the_line(apt, monkeypatch):
    monkeypatch.setattr(debian.os, "geteuid", lambda: 1000)
    with pytest.raises(SetupError, match="apt-get install libgl1 libxi6"):
        debian.install(["libxi6", "libgl1"], "Blender needs them")
    assert apt.calls == []


def test_without_apt_nothing_is_run(apt, monkeypatch):
    monkeypatch.setattr(debian, "APT_GET", "/nowhere/apt-get")
    with pytest.raises(SetupError):
        debian.install(["libgl1"], "Blender needs it")
    assert apt.calls == []


def test_failed_install_is_a_setup_error(apt):
    apt.status = 100
    with pytest.raises(SetupError, match=r"(?s)apt-get install libgl1.*no such package"):
        debian.install(["libgl1"], "Blender needs it")


def test_python_without_venv_gets_it_and_starts_again(apt, monkeypatch):
    started = []
    monkeypatch.setattr(debian.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(debian.os, "execv", lambda path, argv: started.append(argv))
    debian.require_whole_python()
    version = "{}.{}".format(*debian.sys.version_info[:2])
    assert apt.calls[-1][-1] == f"python{version}-venv"
    assert started == [debian.sys.orig_argv]


def test_whole_python_needs_nothing(apt):
    debian.require_whole_python()
    assert apt.calls == []
