"""The checkout as Blender's own tools see it: validated, built, installed."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest

from runner import blender as loader
from runner.environment import CHECKOUT

# What an installed copy needs, and the folders that it has.
NEEDED = {
    "__init__.py",
    "blender_manifest.toml",
    "LICENSE",
    "fitter/__init__.py",
    "fitter/fitting/fit.py",
    "nfm_addon/__init__.py",
    "nfm_addon/operators/import_measurement.py",
    "osl/generate.py",
    "osl/nfm_surface.osl.in",
    "osl/angles.osl.in",
    "osl/isotropic_lookup.osl.in",
    "osl/anisotropic_lookup.osl.in",
    "osl/isotropic_half_vector.osl.in",
    "osl/anisotropic_half_vector.osl.in",
    "osl/sampling.osl.in",
    "osl/reference.osl.in",
    "osl/cosine.osl.in",
    "osl/base.osl.in",
    "osl/base_value.osl.in",
    "osl/native.osl.in",
    "osl/residual.osl.in",
    "osl/residual_lobe.osl.in",
}
FOLDERS = {"fitter", "nfm_addon", "osl"}

MANIFEST = tomllib.loads((CHECKOUT / "blender_manifest.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def blender_ext(extension):
    """Blender's command-line tool for extensions, run with plain Python."""

    def run(*arguments):
        answer = subprocess.run(
            [sys.executable, loader.extension_tool(), *map(str, arguments)],
            capture_output=True,
            text=True,
        )
        assert answer.returncode == 0, answer.stdout + answer.stderr
        assert "error" not in answer.stdout.lower()
        assert "warning" not in answer.stdout.lower()
        assert answer.stderr == ""
        return answer.stdout

    return run


@pytest.fixture(scope="session")
def package(blender_ext, tmp_path_factory):
    """The zip that Blender builds of the checkout."""
    folder = tmp_path_factory.mktemp("package")
    blender_ext("build", "--source-dir", CHECKOUT, "--output-dir", folder)
    (path,) = folder.iterdir()
    return path


def names_in(path):
    with zipfile.ZipFile(path) as archive:
        return {name for name in archive.namelist() if not name.endswith("/")}


def test_blender_accepts_the_checkout(blender_ext):
    assert "Success" in blender_ext("validate", CHECKOUT)


def test_blender_accepts_the_package(blender_ext, package):
    assert package.name == f"nfm-{MANIFEST['version']}.zip"
    assert "Success" in blender_ext("validate", package)


def test_package_holds_what_is_needed(package):
    names = names_in(package)
    assert names >= NEEDED
    # all of it: nothing that the checkout imports is missing
    for folder in FOLDERS:
        tracked = {
            str(path.relative_to(CHECKOUT))
            for pattern in ("*.py", "*.osl.in")
            for path in (CHECKOUT / folder).rglob(pattern)
            if "__pycache__" not in path.parts
        }
        assert {name for name in names if name.startswith(f"{folder}/")} == tracked


def test_package_holds_nothing_of_the_workshop(package):
    names = names_in(package)
    workshop = {"tests", "runner", "benchmarks", "docs", "nfm", "pyproject.toml"}
    assert not [name for name in names if name.split("/")[0] in workshop]
    assert not [name for name in names if any(part.startswith(".") for part in name.split("/"))]
    assert not [name for name in names if "__pycache__" in name or name.endswith((".pyc", ".zip"))]


def test_leftovers_of_work_stay_out(blender_ext, tmp_path):
    """Files that people and tools leave in a checkout."""
    checkout = tmp_path / "checkout"
    left = [
        *(".git/config", ".nfm/python3.13/stamp", ".gitignore", ".ci/run", ".ruff_cache/x"),
        *("tests/osl/x.py", "docs/picture.png", "benchmarks/x.py", "runner/x.py"),
        *("fitter/__pycache__/x.pyc", "nfm", "pyproject.toml", "nfm-1.0.0.zip"),
    ]
    kept = ["__init__.py", "blender_manifest.toml", "fitter/nfm.py", "osl/docs.osl.in"]
    for name in (*left, *kept):
        path = checkout / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    for name in ("__init__.py", "blender_manifest.toml"):
        (checkout / name).write_bytes((CHECKOUT / name).read_bytes())
    output = tmp_path / "nfm.zip"
    blender_ext("build", "--source-dir", checkout, "--output-filepath", output)
    assert names_in(output) == set(kept)


def test_results_of_the_demo_stay_out(blender_ext, tmp_path):
    """./nfm demo writes 35 MB into the current folder, which is often the checkout."""
    checkout = tmp_path / "checkout"
    (checkout / "nfm-demo").mkdir(parents=True)
    (checkout / "nfm-demo" / "sample.binary").touch()
    (checkout / "copper.nfm.json").touch()
    for name in ("__init__.py", "blender_manifest.toml"):
        (checkout / name).write_bytes((CHECKOUT / name).read_bytes())
    output = tmp_path / "nfm.zip"
    blender_ext("build", "--source-dir", checkout, "--output-filepath", output)
    assert names_in(output) == {"__init__.py", "blender_manifest.toml"}


INSTALL_AND_RENDER = """
package, parameters, picture = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
done = bpy.ops.extensions.package_install_files(
    filepath=package, repo="user_default", enable_on_install=True
)
assert done == {"FINISHED"}
root = sys.modules["bl_ext.user_default.nfm"]

mesh = bpy.data.meshes.new("Square")
mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
square = bpy.data.objects.new("Square", mesh)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1, (0, 0, 2)
scene = bpy.context.scene
for item in (square, camera):
    scene.collection.objects.link(item)
scene.camera = camera
bpy.context.view_layer.objects.active = square
bpy.ops.nfm.import_measurement(filepath=parameters)

import importlib, pkgutil
for module in pkgutil.walk_packages(root.__path__, root.__name__ + "."):
    module.name.endswith("__main__") or importlib.import_module(module.name)
from bl_ext.user_default.nfm.nfm_addon import rendering, standard_sphere
scene.world = standard_sphere.new_world(None)
rendering.render_settings(scene, 8, 8, 256, 0)
rendering.render_to_file(scene, Path(picture))
print("installed in", root.__file__)
assert not [name for name in sys.modules if name in ("fitter", "osl", "runner")]
"""


def test_installed_copy_imports_and_renders(
    addon, fitted, package, parameter_path, run_python, tmp_path, monkeypatch
):
    """The directional albedo appears under uniform white light."""
    import numpy as np

    from fitter.models.tables import directional_albedo

    user, elsewhere = tmp_path / "user", tmp_path / "elsewhere"
    user.mkdir()
    elsewhere.mkdir()
    monkeypatch.setenv("BLENDER_USER_RESOURCES", str(user))
    picture = tmp_path / "picture.exr"
    output = run_python(INSTALL_AND_RENDER, package, parameter_path, picture, cwd=elsewhere)
    installed = output.splitlines()[-1].removeprefix("installed in ")
    assert installed == str(user / "extensions" / "user_default" / "nfm" / "__init__.py")
    np.testing.assert_allclose(
        addon("images").read_linear(picture).mean((0, 1)),
        directional_albedo(fitted.model, np.zeros(1))[0],
        rtol=2e-2,
    )


# --- the rules of the Extensions platform ---


def test_permissions_have_reasons():
    assert MANIFEST["permissions"].keys() == {"files"}
    for reason in MANIFEST["permissions"].values():
        assert 10 < len(reason) <= 64
        assert not reason.endswith(".")


def test_licence_and_version_are_said_once():
    assert MANIFEST["license"] == ["SPDX:GPL-3.0-or-later"]
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "version" in project["dynamic"]
    changes = (CHECKOUT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^## \[([\d.]+)\]", changes, re.MULTILINE)[1] == MANIFEST["version"]


# --- from one version to the next ---

OLD_SESSION = """
package, parameters, blend = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(
    filepath=package, repo="user_default", enable_on_install=True
)
mesh = bpy.data.meshes.new("Triangle")
mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
item = bpy.data.objects.new("Triangle", mesh)
bpy.context.scene.collection.objects.link(item)
bpy.context.view_layer.objects.active = item
bpy.ops.nfm.import_measurement(filepath=parameters)
material = item.active_material
# properties that came with later versions
for name in ("quality", "slices", "token", "source_path", "native_error", "native_psnr"):
    material.nfm.property_unset(name)
bpy.ops.wm.save_as_mainfile(filepath=blend)
"""

NEW_SESSION = """
import addon_utils, json, tomllib
package, blend, old_blend = sys.argv[1:]
installed = Path(bpy.utils.user_resource("EXTENSIONS"), "user_default", "nfm")
version = lambda: tomllib.loads((installed / "blender_manifest.toml").read_text())["version"]
versions = [version()]
bpy.ops.extensions.package_install_files(
    filepath=package, repo="user_default", enable_on_install=True
)
versions.append(version())

def state():
    bpy.ops.wm.open_mainfile(filepath=old_blend)
    (material,) = bpy.data.materials
    from bl_ext.user_default.nfm.nfm_addon import editing, material as module
    script = module.find_script_node(material)
    before = script.bytecode, script.script.as_string()
    edited = editing.refresh(material)
    after = script.bytecode, script.script.as_string()
    material.nfm.edit.lobe_1.width = 2.0
    return [before == after, edited, editing.refresh(material), material.nfm.numbers]

states = [state()]
name = "bl_ext.user_default.nfm"
addon_utils.disable(name, default_set=True)
bpy.ops.wm.open_mainfile(filepath=old_blend)
(material,) = bpy.data.materials
without = [hasattr(material, "nfm"), len(bpy.data.node_groups)]
bpy.ops.wm.save_as_mainfile(filepath=blend)
addon_utils.enable(name, default_set=True)
old_blend = blend
states.append(state())
print(json.dumps([versions, states, without]))
"""


def test_upgrade_with_materials_that_an_older_version_made(
    blender_ext, package, run_python, tmp_path, monkeypatch
):
    """Installed over it; then disabled, saved, enabled again. Nothing of a material is lost."""
    older = tmp_path / "older"
    older.mkdir()
    with zipfile.ZipFile(package) as archive:
        archive.extractall(older)
    manifest = older / "blender_manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(re.sub(r'^version = ".*"', 'version = "0.9.0"', text, flags=re.MULTILINE))
    (older / "nfm_addon" / "gone_since.py").touch()
    blender_ext("build", "--source-dir", older, "--output-filepath", tmp_path / "old.zip")
    shutil.rmtree(older)
    user = tmp_path / "user"
    user.mkdir()
    monkeypatch.setenv("BLENDER_USER_RESOURCES", str(user))
    parameters = CHECKOUT / "tests" / "fitter" / "formats" / "version_1" / "preset.nfm.json"
    blend = tmp_path / "old.blend"
    run_python(OLD_SESSION, tmp_path / "old.zip", parameters, blend)
    output = run_python(NEW_SESSION, package, tmp_path / "again.blend", blend)
    versions, states, without = json.loads(output.splitlines()[-1])
    assert versions == ["0.9.0", MANIFEST["version"]]
    assert not (
        user / "extensions" / "user_default" / "nfm" / "nfm_addon" / "gone_since.py"
    ).exists()
    for unchanged, edited, edited_then, numbers in states:
        assert unchanged
        assert edited is False
        assert edited_then is True
        assert numbers == 822
    assert without == [False, 1]
