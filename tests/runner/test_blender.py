"""A stub extension, loaded by processes of its own: the real one belongs to this process."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from runner.environment import CHECKOUT

pytest.importorskip("bpy")

ADDON = """
import bpy

class NFM_OT_stub(bpy.types.Operator):
    bl_idname = "nfm.stub"
    bl_label = "Stub"

    def execute(self, context):
        return {"FINISHED"}

def register():
    bpy.utils.register_class(NFM_OT_stub)

def unregister():
    bpy.utils.unregister_class(NFM_OT_stub)
"""
COMMAND_LINE = """
import bpy

def main(arguments):
    print(arguments, bool(bpy.ops.nfm.stub()))
    return 4
"""
FIXTURE_TESTS = """
def test_first(blender):
    blender.ops.mesh.primitive_cube_add()
    assert blender.ops.nfm.stub() == {"FINISHED"}

def test_second(blender, extension):
    assert len(blender.data.objects) == 0
    assert blender.ops.nfm.stub() == {"FINISHED"}
    assert extension.__name__ == "bl_ext.nfm_dev.nfm"
"""


@pytest.fixture
def checkout(tmp_path) -> Path:
    """A checkout with the real runner and a stub add-on."""
    checkout = tmp_path / "check out"
    addon = checkout / "nfm_addon"
    addon.mkdir(parents=True)
    (addon / "__init__.py").write_text(ADDON)
    (addon / "command_line.py").write_text(COMMAND_LINE)
    for name in ("__init__.py", "blender_manifest.toml", "pyproject.toml"):
        shutil.copy(CHECKOUT / name, checkout)
    shutil.copytree(CHECKOUT / "runner", checkout / "runner")
    return checkout


def run_python(checkout: Path, *arguments: str) -> subprocess.CompletedProcess:
    """Run the environment's interpreter there, with a home and a temporary folder of its own."""
    variables = {name: v for name, v in os.environ.items() if not name.startswith("BLENDER_")}
    home, temporary = checkout.parent / "home", checkout.parent / "tmp"
    home.mkdir(exist_ok=True)
    temporary.mkdir(exist_ok=True)
    variables |= {"PYTHONPATH": str(checkout), "HOME": str(home), "TMPDIR": str(temporary)}
    variables["BLENDER_USER_CONFIG"] = str(home / "config")
    return subprocess.run(
        [sys.executable, "-P", *arguments],
        env=variables,
        cwd=checkout,
        capture_output=True,
        text=True,
    )


def test_verb_reaches_the_command_line(checkout):
    answer = run_python(checkout, "-m", "runner.blender", "eval", "a b")
    assert (answer.stdout, answer.returncode) == ("['eval', 'a b'] True\n", 4), answer.stderr


def test_leaves_nothing_behind(checkout):
    assert run_python(checkout, "-m", "runner.blender", "eval").returncode == 4
    assert list((checkout.parent / "tmp").iterdir()) == []
    # Blender makes the empty thumbnail folders of the desktop at start, whatever it is told.
    assert {path.name for path in (checkout.parent / "home").iterdir()} <= {".cache"}
    assert (checkout / "nfm_addon" / "command_line.py").exists()


def test_error_in_register_is_not_swallowed(checkout):
    (checkout / "nfm_addon" / "__init__.py").write_text("def register():\n    1 / 0\n")
    answer = run_python(checkout, "-m", "runner.blender", "eval")
    assert answer.returncode == 1
    cause, error = answer.stderr.split("direct cause")
    assert "ZeroDivisionError" in cause
    assert "ExtensionError: Blender did not enable" in error


def test_given_checkout_empty_scene_and_oslquery(checkout):
    elsewhere = checkout.rename(checkout.with_name("elsewhere"))
    shutil.copytree(elsewhere / "runner", checkout / "runner")
    code = (
        "import sys, pathlib; from runner.blender import load_extension\n"
        "print(load_extension(pathlib.Path(sys.argv[1])).__name__)\n"
        "import bpy, oslquery\n"
        "print(len(bpy.data.objects), bpy.utils.user_resource('CONFIG'))"
    )
    answer = run_python(checkout, "-c", code, str(elsewhere))
    name, rest = answer.stdout.splitlines()
    assert name == "bl_ext.nfm_dev.nfm"
    assert rest.startswith("0 ")
    assert "nfm-blender-" in rest


def test_fixtures_of_conftest(checkout):
    tests = checkout / "tests"
    tests.mkdir()
    for name in ("conftest.py", "bases.py", "models.py"):
        shutil.copy(CHECKOUT / "tests" / name, tests)
    # what the fixtures look into; the stub add-on stays the one that registers
    for part in ("fitter", "osl"):
        shutil.copytree(CHECKOUT / part, checkout / part)
    stub = checkout / "nfm_addon"
    stubbed = {path.name for path in stub.iterdir()}
    shutil.copytree(
        CHECKOUT / "nfm_addon",
        stub,
        ignore=lambda folder, _names: stubbed if Path(folder).name == "nfm_addon" else (),
        dirs_exist_ok=True,
    )
    (tests / "test_fixtures.py").write_text(FIXTURE_TESTS)
    answer = run_python(checkout, "-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert "2 passed" in answer.stdout, answer.stdout
