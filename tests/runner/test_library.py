# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm library build, with fits and pictures that take no time."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from fitter.errors import NfmError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs import library, workers
from runner import blender
from runner import library as verb
from tests.models import MODELS

KEYS = ["porcelain", "rubber-black"]


@pytest.fixture
def made(monkeypatch, tmp_path):
    """What was fitted and what was rendered."""
    done = SimpleNamespace(fitted=[], rendered=[])

    def fit(entry, _folder, path):
        if path.exists():
            return False
        parameter_file.save(path, FittedMaterial(entry.title, MODELS["matte"]), library.DIGITS)
        done.fitted.append(entry.key)
        return True

    def render(_parameters, picture):
        picture.write_bytes(b"picture")
        done.rendered.append(picture.stem)

    monkeypatch.setattr(library, "fit", fit)
    monkeypatch.setattr(workers, "run", lambda work, tasks, _jobs: map(work, tasks))
    monkeypatch.setattr(blender, "load_extension", lambda: SimpleNamespace(__name__="none"))
    monkeypatch.setattr(verb, "import_module", lambda _name: SimpleNamespace(render=render))
    return done


def build(tmp_path, *arguments):
    return verb.main(["build", "-o", str(tmp_path / "library"), *arguments])


def test_makes_what_is_missing(made, tmp_path):
    only = ("--only", ",".join(KEYS))
    assert build(tmp_path, *only) == 0
    assert (made.fitted, made.rendered) == (KEYS, KEYS)
    assert build(tmp_path, *only) == 0
    assert (made.fitted, made.rendered) == (KEYS, KEYS)
    Path(tmp_path, "library", "porcelain.png").unlink()
    assert build(tmp_path, *only) == 0
    assert (made.fitted, made.rendered) == (KEYS, [*KEYS, "porcelain"])
    assert build(tmp_path, *only, "--again") == 0
    assert (made.fitted, made.rendered[3:]) == (KEYS * 2, KEYS)


def test_all_of_it(made, tmp_path):
    assert build(tmp_path) == 0
    assert made.fitted == [entry.key for entry in library.ENTRIES]


def test_a_material_that_there_is_not(made, tmp_path, capsys):
    assert build(tmp_path, "--only", "porcelain,kryptonite") == verb.BAD_USAGE
    assert "there is no material 'kryptonite'" in capsys.readouterr().err
    assert made.fitted == []


def test_what_goes_wrong_is_a_line(made, tmp_path, capsys, monkeypatch):
    def fails(*_arguments):
        raise NfmError("chm_mint_rgb.bsdf: no such file")

    monkeypatch.setattr(library, "fit", fails)
    assert build(tmp_path, "--only", "chm_mint") == verb.FAILED
    assert "chm_mint_rgb.bsdf: no such file" in capsys.readouterr().err
