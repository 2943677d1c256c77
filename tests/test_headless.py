# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/HEADLESS.md, typed as it stands: a fresh user, no display, a blender on the path."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from fitter import synthetic
from fitter.formats import parameter_file
from runner import ui_test
from runner.environment import CHECKOUT

pytest.importorskip("bpy")

DOCUMENT = CHECKOUT / "docs" / "HEADLESS.md"
SCRIPTS = CHECKOUT / "docs" / "headless"
MODULE = '#!/bin/sh\nexec "{python}" -P -m tests.blender_program "$@"\n'


def blocks(language):
    text = DOCUMENT.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def worker(tmp_path_factory):
    """Run a command in a folder with what the document speaks of."""
    import bpy

    folder = tmp_path_factory.mktemp("farm")
    programs, user = folder / "bin", folder / "user"
    programs.mkdir()
    user.mkdir()
    program = programs / "blender"
    if bpy.app.module:
        program.write_text(MODULE.format(python=sys.executable))
        program.chmod(0o755)
    else:
        program.symlink_to(bpy.app.binary_path)
    here = folder / "here"
    shutil.copytree(SCRIPTS, here)
    ui_test.build_package(folder).rename(here / "nfm.zip")
    synthetic.write_sample(here / "gold-paint.binary", "copper-paint")
    variables = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "OCIO")}
    variables |= {
        "PATH": f"{programs}:{os.environ['PATH']}",
        "BLENDER_USER_RESOURCES": str(user),
        "PYTHONPATH": str(CHECKOUT),
    }

    def run(command):
        return subprocess.run(
            ["sh", "-ec", command], cwd=here, env=variables, capture_output=True, text=True
        )

    run.folder, run.user = here, user
    return run


def test_scripts_are_those_of_the_document():
    quoted = [block.partition("\n") for block in blocks("python")]
    names = [head.removeprefix("# ") for head, _, _ in quoted]
    assert sorted(names) == sorted(path.name for path in SCRIPTS.glob("*.py"))
    for name, (_, _, code) in zip(names, quoted, strict=True):
        assert code == (SCRIPTS / name).read_text(encoding="utf-8")


@pytest.mark.osl
def test_every_command_does_what_the_document_says(worker):
    for command in blocks("sh"):
        answer = worker(command)
        assert answer.returncode == 0, f"{command}\n{answer.stdout}{answer.stderr}"
        assert "Traceback" not in answer.stderr, answer.stderr
    here = worker.folder
    assert json.loads((here / "gold-paint.json").read_text())["output"] == "gold-paint.nfm.json"
    assert parameter_file.load(here / "gold-paint.nfm.json").fit["quality"] == "draft"
    assert (here / "again.binary").stat().st_size == (here / "gold-paint.binary").stat().st_size
    frames = sorted(path.name for path in (here / "frames").iterdir())
    assert frames == ["shot_0001.exr", "shot_0002.exr"]
    assert (here / "ball.exr").is_file()
    # nothing but what was asked for
    assert not [path for path in here.rglob("*") if path.name.startswith(".nfm")]
    assert {path.name for path in worker.user.iterdir()} <= {"config", "extensions", "cache"}


@pytest.mark.osl
def test_frames_without_the_add_on_show_the_material_and_repeat(addon, worker):
    """After the commands above; whatever the number of threads."""
    read = addon("images").read_linear
    first = read(worker.folder / "frames" / "shot_0001.exr")
    assert (first == read(worker.folder / "ball.exr")).all()
    again = "blender -b --factory-startup shot.blend -o //again_#### -F OPEN_EXR -t 1 -s 1 -e 1 -a"
    assert worker(again).returncode == 0
    assert (read(worker.folder / "again_0001.exr") == first).all()
    lit = first[..., 0] > 0.02
    # copper, not the grey of a material that is missing or the magenta of one that failed
    assert lit.mean() > 0.2
    assert first[lit, 0].mean() > 1.3 * first[lit, 2].mean()


@pytest.mark.osl
def test_failures_have_their_status(worker):
    """After the installation above."""
    (worker.folder / "broken.binary").write_bytes(b"nothing")
    answer = worker("blender --command nfm fit broken.binary")
    assert answer.returncode == 1
    (line,) = [line for line in answer.stderr.splitlines() if line.startswith("nfm: ")]
    assert line.startswith("nfm: broken.binary: ")
    assert worker("blender --command nfm render gold-paint.nfm.json").returncode == 2
    script = "blender -b --python-exit-code 1 --python make_shot.py -- broken.binary a.blend a.exr"
    assert worker(script).returncode == 1
    assert not (worker.folder / "a.blend").exists()
