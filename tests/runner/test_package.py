import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from runner import blender, environment, package
from runner.messages import SetupError


@pytest.fixture
def downloads(monkeypatch, tmp_path):
    """Stands in for pip: wheels without content, in a home of their own."""
    made = []

    def download(pin, python, platform, folder):
        folder.mkdir(parents=True, exist_ok=True)
        tag = f"cp{python.replace('.', '')}"
        path = folder / f"openexr-{pin.partition('==')[2]}-{tag}-{tag}-{platform}.whl"
        with zipfile.ZipFile(path, "w"):
            pass
        made.append(path)

    monkeypatch.setattr(package, "download", download)
    monkeypatch.setenv("NFM_HOME", str(tmp_path / "home"))
    return made


def test_wheels_are_downloaded_once_for_every_blender(downloads, tmp_path):
    first = list(package.downloaded_wheels(tmp_path / "wheels"))
    assert first == downloads
    assert len(first) == len(package.PYTHONS) * len(package.PLATFORMS)
    assert list(package.downloaded_wheels(tmp_path / "wheels")) == first
    assert len(downloads) == len(first)


def test_the_copy_has_a_manifest_with_the_wheels(downloads, tmp_path):
    wheels = list(package.downloaded_wheels(tmp_path / "wheels"))
    staged = package.stage(environment.CHECKOUT, tmp_path / "copy", wheels)
    manifest = tomllib.loads((staged / "blender_manifest.toml").read_text(encoding="utf-8"))
    original = tomllib.loads(
        (environment.CHECKOUT / "blender_manifest.toml").read_text(encoding="utf-8")
    )
    named = manifest.pop("wheels")
    assert manifest == original
    assert sorted(named) == sorted(f"./wheels/{wheel.name}" for wheel in wheels)
    assert all((staged / name).is_file() for name in named)
    assert not (staged / ".git").exists()


def test_blender_builds_it(downloads, extension, tmp_path, capfd):
    output = tmp_path / "new" / "folder"
    assert package.main(["-o", str(output)]) == 0
    assert "error" not in capfd.readouterr().out.lower()
    (built,) = output.glob("*.zip")
    with zipfile.ZipFile(built) as archive:
        names = archive.namelist()
    assert sum(name.startswith("wheels/") for name in names) == len(downloads)
    assert "fitter/formats/utia.py" in names
    assert not [name for name in names if name.startswith(("tests/", "runner/", "demo.blend"))]


def test_a_zip_for_each_platform(downloads, extension, tmp_path):
    """With its own wheels, and Blender's validator takes all of them."""
    assert package.main(["-o", str(tmp_path / "zips"), "--split-platforms"]) == 0
    built = {path.stem.partition("-1.0.0-")[2]: path for path in (tmp_path / "zips").iterdir()}
    assert built.keys() == {name.replace("-", "_") for name in package.PLATFORMS.values()}
    for tag, name in package.PLATFORMS.items():
        path = built[name.replace("-", "_")]
        with zipfile.ZipFile(path) as archive:
            wheels = [item for item in archive.namelist() if item.startswith("wheels/")]
            manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        assert len(wheels) == len(package.PYTHONS)
        assert all(wheel.endswith(f"-{tag}.whl") for wheel in wheels)
        generated = manifest["build"]["generated"]
        assert generated["platforms"] == [name]
        assert sorted(generated["wheels"]) == sorted(f"./{wheel}" for wheel in wheels)
        tool = [sys.executable, blender.extension_tool(), "validate", path]
        answer = subprocess.run([*map(str, tool)], capture_output=True, text=True)
        assert "Success" in answer.stdout, answer.stdout


def test_failed_download(monkeypatch, tmp_path, capsys):
    def failing(*arguments):
        raise SetupError("pip could not download")

    monkeypatch.setattr(package, "download", failing)
    monkeypatch.setenv("NFM_HOME", str(tmp_path / "home"))
    assert package.main(["-o", str(tmp_path)]) == 1
    assert "pip could not download" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.zip"))


def test_pip_that_fails_says_so(monkeypatch, tmp_path):
    failed = subprocess.CompletedProcess([], 1)
    monkeypatch.setattr(package.subprocess, "run", lambda *arguments, **options: failed)
    with pytest.raises(SetupError, match=r"OpenEXR==1 "):
        package.download("OpenEXR==1", "3.11", "win_amd64", Path(tmp_path))
