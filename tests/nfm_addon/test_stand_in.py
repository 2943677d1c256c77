# SPDX-License-Identifier: GPL-3.0-or-later
"""What engines without OSL show."""

import pytest

from fitter.formats.parameter_file import FittedMaterial
from fitter.pictures.sphere import rendered_psnr
from tests.models import MODELS


@pytest.fixture
def build(addon):
    def make(name):
        return addon("material").build(FittedMaterial(name, MODELS[name]))

    return make


@pytest.fixture
def pictures(addon, render, sphere_scene):
    """Pictures (2, 1, n, 3) by Cycles: the material, and its stand-in."""

    def make(material):
        tree = material.node_tree
        node = addon("material").find_group_node(material)
        surface = tree.get_output_node("CYCLES").inputs["Surface"]
        out = []
        for name in ("BSDF", "Stand-in"):
            tree.links.new(node.outputs[name], surface)
            out.append(render(sphere_scene(material, samples=64)).reshape(1, -1, 3))
        return out

    return make


@pytest.mark.osl
@pytest.mark.parametrize(
    ("name", "least"), [("matte", 40), ("plastic", 40), ("metal", 40), ("paint", 35)]
)
def test_looks_like_the_material(name, least, build, pictures):
    material, substitute = pictures(build(name))
    assert rendered_psnr(substitute, material)[0] > least


@pytest.mark.osl
def test_follows_the_sockets(addon, build, pictures):
    material = build("paint")
    inputs = addon("material").find_group_node(material).inputs
    inputs["Diffuse"].default_value = (0.1, 0.5, 0.1, 1)
    inputs["Lobe 2 Scale"].default_value = (0, 0.1, 0.2, 1)
    inputs["Lobe 3 Scale"].default_value = (0.5, 0, 0, 1)
    picture, substitute = pictures(material)
    assert rendered_psnr(substitute, picture)[0] > 35


@pytest.mark.osl
def test_follows_a_new_model(addon, build, pictures):
    material = build("plastic")
    addon("material").replace_model(material, FittedMaterial("metal", MODELS["metal"]))
    picture, substitute = pictures(material)
    assert rendered_psnr(substitute, picture)[0] > 40
    frames = [
        node
        for node in addon("material").find_group_node(material).node_tree.nodes
        if node.type == "FRAME" and node.name.startswith("NFM Stand-in")
    ]
    assert len(frames) == 1


def test_viewport_display(build):
    plastic, metal = build("plastic"), build("metal")
    assert plastic.diffuse_color[2] > 1.5 * plastic.diffuse_color[0]
    assert metal.metallic == 1
    assert plastic.metallic < 0.5
    assert metal.roughness < 0.3
