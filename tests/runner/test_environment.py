import fcntl
import threading
from pathlib import Path

import pytest

from runner import environment
from runner.messages import SetupError

PYPROJECT = """
[project]
dependencies = ["numpy=={}"]
[project.optional-dependencies]
test = ["pytest==9"]
report = ["matplotlib"]
"""


class Installer:
    """Stands in for the commands that make a venv and fill it."""

    def __init__(self):
        self.commands: list[list[str]] = []
        self.pip_fails = False

    def __call__(self, name: str, *command: str | Path) -> None:
        self.commands.append([str(part) for part in command])
        if "venv" in command:
            python = command[-1] / "bin" / "python"
            python.parent.mkdir(parents=True, exist_ok=True)
            python.touch()
        elif self.pip_fails:
            raise SetupError("no network")

    def kinds(self) -> list[str]:
        """Return what was done since the last call."""
        kinds = ["venv" if "venv" in command else "pip" for command in self.commands]
        self.commands.clear()
        return kinds


@pytest.fixture
def installer(monkeypatch, tmp_path) -> Installer:
    installer = Installer()
    monkeypatch.setattr(environment, "_run", installer)
    monkeypatch.setenv("NFM_HOME", str(tmp_path / "home"))
    return installer


@pytest.fixture
def checkout(tmp_path) -> Path:
    pin_numpy(tmp_path, 1)
    return tmp_path


def pin_numpy(checkout: Path, version: int) -> None:
    (checkout / "pyproject.toml").write_text(PYPROJECT.format(version))


def test_installs_dependencies_and_test_extra_once(installer, checkout, capsys):
    python = environment.ensure(checkout=checkout)
    assert python == environment.folder() / "bin" / "python"
    assert installer.commands[1][-2:] == ["numpy==1", "pytest==9"]
    assert installer.kinds() == ["venv", "pip"]
    capsys.readouterr()

    assert environment.ensure(checkout=checkout) == python
    assert installer.kinds() == []
    assert capsys.readouterr() == ("", "")


def test_changed_pins_make_it_again(installer, checkout):
    environment.ensure(checkout=checkout)
    installer.kinds()
    pin_numpy(checkout, 2)
    environment.ensure(checkout=checkout)
    assert installer.kinds() == ["venv", "pip"]


def test_interrupted_install_is_made_again(installer, checkout):
    installer.pip_fails = True
    with pytest.raises(SetupError):
        environment.ensure(checkout=checkout)
    installer.kinds()
    installer.pip_fails = False
    environment.ensure(checkout=checkout)
    assert installer.kinds() == ["venv", "pip"]


def test_interrupted_repair_does_not_leave_the_old_stamp(installer, checkout):
    environment.ensure(checkout=checkout)
    installer.pip_fails = True
    with pytest.raises(SetupError):
        environment.ensure(["report"], checkout=checkout)
    installer.kinds()
    installer.pip_fails = False
    environment.ensure(checkout=checkout)
    assert installer.kinds() == ["venv", "pip"]


def test_unreadable_stamp_counts_as_none(installer, checkout):
    environment.ensure(checkout=checkout)
    installer.kinds()
    (environment.folder() / "stamp").write_text('{"interp')
    environment.ensure(checkout=checkout)
    assert installer.kinds() == ["venv", "pip"]


def test_other_interpreter_makes_it_again(installer, checkout, monkeypatch):
    environment.ensure(checkout=checkout)
    installer.kinds()
    monkeypatch.setattr(environment.platform, "machine", lambda: "another")
    environment.ensure(checkout=checkout)
    assert installer.kinds() == ["venv", "pip"]


def test_removed_base_interpreter_makes_it_again(installer, checkout):
    python = environment.ensure(checkout=checkout)
    installer.kinds()
    python.unlink()
    python.symlink_to("/nowhere/python")
    assert not environment.is_ready(environment.folder(), {})


def test_extra_is_added_with_the_pins(installer, checkout):
    environment.ensure(checkout=checkout)
    installer.kinds()
    environment.ensure(["report"], checkout=checkout)
    assert installer.commands[0][-3:] == ["numpy==1", "pytest==9", "matplotlib"]
    assert installer.kinds() == ["pip"]

    environment.ensure(["report"], checkout=checkout)
    environment.ensure(checkout=checkout)
    assert installer.kinds() == []


def test_waits_for_another_nfm_and_uses_its_work(installer, checkout, capsys):
    python = environment.ensure(checkout=checkout)
    installer.kinds()
    stamp = environment.folder() / "stamp"
    finished = stamp.read_text()
    stamp.unlink()
    lock = Path(f"{environment.folder()}.lock").open("w")  # noqa: SIM115
    fcntl.flock(lock, fcntl.LOCK_EX)

    def finish() -> None:
        stamp.write_text(finished)
        lock.close()

    timer = threading.Timer(0.3, finish)
    timer.start()
    assert environment.ensure(checkout=checkout) == python
    timer.join()
    assert installer.kinds() == []
    assert "waiting" in capsys.readouterr().err


def test_failed_command_is_a_setup_error():
    with pytest.raises(SetupError, match="pip failed"):
        environment._run("pip", "false")


def test_reads_this_projects_pins():
    pins = environment.read_requirements(environment.CHECKOUT / "pyproject.toml")
    assert any(line.startswith("bpy==") for line in pins["dependencies"])
    assert set(environment.ALWAYS) <= pins.keys()
