"""A small fitted material, objects to put it on, and processes of their own."""

import os
import re
import subprocess
import sys

import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.measurement import Source
from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import fit_base_lobes
from tests.models import MODELS


@pytest.fixture(scope="session")
def fitted():
    """A material as a fit leaves it."""
    return FittedMaterial(
        "blue plastic",
        MODELS["plastic"],
        Source("blue.binary", "MERL", "ab" * 32),
        {
            "objective": 0.00125,
            "iterations": 57,
            "weight": "gamma",
            "mean_log_error": 0.125,
            "largest_directional_albedo": 0.75,
            "bins_usable": 1_000_000,
            "bins_below_horizon": 400_000,
            "bins_negative": 50_000,
            "bins_not_finite": 8_000,
        },
    )


@pytest.fixture(scope="session")
def native_error(fitted):
    """Error of the base lobes of the fitted material."""
    return base_error(fitted.model, fit_base_lobes(fitted.model))


@pytest.fixture
def parameter_path(tmp_path, fitted):
    """The fitted material as an .nfm.json file."""
    path = tmp_path / "blue.nfm.json"
    parameter_file.save(path, fitted)
    return path


@pytest.fixture
def mesh_object(blender):
    """The active object: a mesh with so many material slots, each with a material."""

    def make(slots=0):
        data = blender.data
        item = data.objects.new("Thing", data.meshes.new("Thing"))
        for number in range(slots):
            item.data.materials.append(data.materials.new(f"old {number}"))
        blender.context.scene.collection.objects.link(item)
        blender.context.view_layer.objects.active = item
        return item

    return make


@pytest.fixture
def all_names(blender):
    """The names in every collection of bpy.data."""

    def names():
        return {
            kind.identifier: [item.name for item in getattr(blender.data, kind.identifier)]
            for kind in blender.data.bl_rna.properties
            # all_ids, since Blender 5: the other collections once more
            if kind.type == "COLLECTION" and kind.identifier != "all_ids"
        }

    return names


@pytest.fixture
def undo_steps(addon, blender, monkeypatch):
    """Have the add-on make undo steps, as in a window; their names so far."""
    names = []

    def push(message):
        names.append(message)
        blender.ops.ed.undo_push(message=message)

    monkeypatch.setattr(addon("undo"), "push", push)
    return names


@pytest.fixture
def sphere_scene(coarse_sphere):
    """The standard sphere, small and coarse."""

    def build(material, resolution=24, samples=4):
        module = coarse_sphere(64)
        return module.build_scene(
            material, module.SphereView(resolution=resolution, samples=samples)
        )

    return build


@pytest.fixture
def render(addon, tmp_path):
    """Pixels (h, w, 3) of a scene."""

    def run(scene):
        path = tmp_path / "picture.exr"
        addon("rendering").render_to_file(scene, path)
        return addon("images").read_linear(path)

    return run


@pytest.fixture(scope="session")
def run_python():
    """Run code in a process of its own, which must succeed; returns what it printed.

    It does not find the checkout by itself, nor an extension. It has Blender's scratch settings,
    and `oslquery` where a real Blender has it. Inside a full Blender, it is another one.
    """

    def run(code, *arguments, blender=True, cwd=None):
        # Blender 5 sets OCIO, and says so on standard output where it finds it set
        variables = {name: value for name, value in os.environ.items() if name != "OCIO"}
        command = _blender_command(code) if blender else _python_command(SETUP + code)
        answer = subprocess.run(
            [*command, *map(str, arguments)], env=variables, cwd=cwd, capture_output=True, text=True
        )
        assert answer.returncode == 0, answer.stdout + answer.stderr
        assert "Warning" not in answer.stderr, answer.stderr
        assert "Traceback" not in answer.stderr, answer.stderr
        return BLENDER_SAYS.sub("", answer.stdout)

    return run


SETUP = "import sys; from pathlib import Path\n"

MODULE_SETUP = """
import bpy
python = 'python{}.{}'.format(*sys.version_info[:2])
packages = Path(bpy.utils.resource_path('LOCAL'), 'python', 'lib', python)
sys.path.append(str(packages / 'site-packages'))
"""

FULL_SETUP = """
import bpy, warnings
warnings.simplefilter('default', DeprecationWarning)
sys.argv = ['-c', *sys.argv[sys.argv.index('--') + 1:]]
"""

BLENDER_SAYS = re.compile(r"^(Blender \d.*|\s*Blender quit)\n", re.MULTILINE)


def _python_command(code):
    return [sys.executable, "-P", "-W", "default::DeprecationWarning", "-c", code]


def _blender_command(code):
    import bpy

    if bpy.app.module:
        return _python_command(SETUP + MODULE_SETUP + code)
    options = ["-b", "--factory-startup", "--python-exit-code", "1"]
    return [bpy.app.binary_path, *options, "--python-expr", SETUP + FULL_SETUP + code, "--"]
