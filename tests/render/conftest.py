"""Rendering of factor models, for the tests of this folder."""

from pathlib import Path

import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.render.scenes import Stage


def pytest_collection_modifyitems(items):
    """What is rendered here is OSL."""
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent):
            item.add_marker("osl")


@pytest.fixture
def stage(blender, addon):
    """Maker of small scenes."""
    return Stage(blender, addon)


@pytest.fixture
def sphere(coarse_sphere):
    """The standard sphere, coarser than a picture for people but smooth enough for its figures."""
    return coarse_sphere(256)


@pytest.fixture
def script_material(blender, addon):
    """Material of OSL source with an output BSDF; attributes: those of the mesh, by socket."""

    def build(source, attributes=None):
        material = blender.data.materials.new("script")
        tree = addon("node_trees").empty_tree(material)
        script = tree.nodes.new("ShaderNodeScript")
        addon("script_node").fill(script, "script.osl", source)
        for socket, name in (attributes or {}).items():
            attribute = tree.nodes.new("ShaderNodeAttribute")
            attribute.attribute_name = name
            tree.links.new(attribute.outputs["Vector"], script.inputs[socket])
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(script.outputs["BSDF"], output.inputs["Surface"])
        return material

    return build


@pytest.fixture
def new_material(addon):
    """Material of a factor model."""

    def build(model, sampling="REFERENCE", candidates=None):
        module = addon("material")
        material = module.build(FittedMaterial("test", model), sampling)
        if candidates:
            module.find_script_node(material).inputs["Candidates"].default_value = candidates
        return material

    return build


@pytest.fixture
def render(addon, tmp_path):
    """Pixels (h, w, 3) of a scene."""

    def run(scene):
        path = tmp_path / "picture.exr"
        addon("rendering").render_to_file(scene, path)
        return addon("images").read_linear(path).astype(float)

    return run
