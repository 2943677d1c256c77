# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm ui-test without a window: what it builds, and what it says where it cannot run."""

import zipfile

import pytest

from runner import ui_test
from runner.messages import SetupError


def test_package_is_that_of_the_checkout(tmp_path):
    package = ui_test.build_package(tmp_path)
    with zipfile.ZipFile(package) as archive:
        names = set(archive.namelist())
    assert {"blender_manifest.toml", "nfm_addon/panel.py", "fitter/job.py"} <= names
    assert {"library/chm_mint.nfm.json", "library/chm_mint.png", "library/README.md"} <= names
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
    monkeypatch.setattr(ui_test, "_launcher", lambda *_: Fake())
    assert ui_test._run(None, tmp_path, session) == installing
    assert calls[0][-1] == "/project/nfm-1.zip"
    assert len(calls) == (1 if installing else 2)
    assert (tmp_path / f"{session}.py").is_file()
