# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm ui-test without a window: what it builds, and what it says where it cannot run."""

import zipfile
from pathlib import Path

import pytest

from runner import ui_test
from runner.messages import SetupError


def test_package_is_that_of_the_checkout(tmp_path):
    package = ui_test.build_package(tmp_path)
    with zipfile.ZipFile(package) as archive:
        names = set(archive.namelist())
    assert {"blender_manifest.toml", "nfm_addon/panel.py", "fitter/jobs/job.py"} <= names
    library = {name for name in names if name.startswith("library/")}
    assert "library/README.md" in library
    assert any(name.endswith(".nfm.json") for name in library)
    assert not [name for name in names if name.startswith(("tests/", "runner/"))]


def test_without_a_blender_it_says_how_to_give_one(tmp_path, monkeypatch):
    monkeypatch.setattr(ui_test, "WINDOW_TOOL", tmp_path / "none.sh")
    with pytest.raises(SetupError, match="--blender PATH"):
        ui_test._launcher(None, tmp_path)


def test_a_blender_that_is_none_is_told(tmp_path):
    path = tmp_path / "blender"
    path.touch()
    with pytest.raises(SetupError, match="is not a program that can be run"):
        ui_test._launcher(path, tmp_path)


@pytest.mark.parametrize("session", ui_test.SESSIONS)
@pytest.mark.parametrize("installing", [0, 3])
def test_the_session_follows_the_installation_if_that_went_well(
    installing, session, tmp_path, monkeypatch
):
    calls = []

    class Fake:
        project = "/project"

        def run(self, *arguments):
            calls.append(arguments)
            return installing if "--command" in arguments else 0

    package = tmp_path / "nfm-1.zip"
    monkeypatch.setattr(ui_test, "build_package", lambda _folder: package)
    monkeypatch.setattr(ui_test, "_write_samples", lambda _folder: None)
    assert ui_test._run(Fake(), tmp_path, session) == installing
    assert calls[0][-1] == "/project/nfm-1.zip"
    assert len(calls) == (1 if installing else 2)
    names = {path.name for path in tmp_path.iterdir()}
    assert {f"{session}.py", "driver.py", "xdnd.py"} <= names


def test_without_a_window_it_is_skipped_only_if_asked(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(ui_test, "WINDOW_TOOL", tmp_path / "none.sh")
    assert ui_test.main([]) == ui_test.FAILED
    assert "skipped" not in capfd.readouterr().err
    assert ui_test.main(["--if-possible"]) == 0
    error = capfd.readouterr().err
    assert "--blender PATH" in error
    assert "skipped" in error


def test_a_session_that_fails_is_no_reason_to_skip(monkeypatch):
    monkeypatch.setattr(ui_test.WindowTool, "prepare", lambda _self: None)
    monkeypatch.setattr(ui_test, "WINDOW_TOOL", Path(__file__))
    monkeypatch.setattr(ui_test, "_run", lambda *_: 3)
    assert ui_test.main(["--if-possible"]) == 3


def executable(path, script):
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize("status", [0, 5])
def test_the_window_is_set_up_once(status, tmp_path, monkeypatch):
    """By a tool that notes its arguments and makes, or does not make, what it is for."""
    root = tmp_path / "root"
    script = f'echo "$@" >> {tmp_path}/calls; [ {status} = 0 ] && mkdir -p {root}/usr/bin && '
    tool = executable(tmp_path / "tool.sh", f"{script} touch {root}/usr/bin/blender; exit {status}")
    executable(tmp_path / "debootstrap", "")
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.setattr(ui_test, "WINDOW_TOOL", tool)
    monkeypatch.setattr(ui_test, "WINDOW_ROOT", root)
    monkeypatch.setattr(ui_test.os, "geteuid", lambda: 0)
    window = ui_test.WindowTool(tmp_path)
    if status:
        with pytest.raises(SetupError, match="could not be set up"):
            window.prepare()
        return
    window.prepare()
    window.prepare()
    assert (tmp_path / "calls").read_text(encoding="utf-8") == f"setup {root}\n"


def test_only_root_sets_up_a_window(tmp_path, monkeypatch):
    monkeypatch.setattr(ui_test, "WINDOW_ROOT", tmp_path)
    monkeypatch.setattr(ui_test.os, "geteuid", lambda: 1000)
    with pytest.raises(SetupError, match="only root"):
        ui_test.WindowTool(tmp_path).prepare()


def test_a_blender_of_this_machine_gets_a_display_and_settings_of_its_own(tmp_path, monkeypatch):
    path = executable(
        tmp_path / "blender",
        f'echo "$DISPLAY $BLENDER_USER_RESOURCES $@" >> {tmp_path}/calls; exit 7',
    )
    # an X server that tells its number
    executable(tmp_path / "Xvfb", "echo 42 > /proc/self/fd/$2; exec sleep 60")
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    monkeypatch.delenv("DISPLAY", raising=False)
    project = tmp_path / "project"
    project.mkdir()
    blender = ui_test._launcher(path, project)
    blender.prepare()
    assert blender.run("--python", "x.py") == 7
    assert blender.run("--command", "extension") == 7
    calls = (tmp_path / "calls").read_text(encoding="utf-8").splitlines()
    assert calls == [f":42 {project}/user --python x.py", f" {project}/user --command extension"]
