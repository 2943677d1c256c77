"""Rendering of factor models, for the tests of this folder."""

import pytest

from fitter.parameter_file import FittedMaterial


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
