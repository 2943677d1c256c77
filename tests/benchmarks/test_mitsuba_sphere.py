# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba and Cycles see the same sphere the same way round."""

import numpy as np
import pytest

from benchmarks import mitsuba_sphere

SIZE = 16


@pytest.fixture(scope="module")
def colourful(tmp_path_factory, extension):
    """A map whose six sides have six colours."""
    from importlib import import_module

    rows, columns = 32, 64
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    phi = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    polar = np.broadcast_to(np.cos(theta)[:, None], (rows, columns))
    round_about = np.sin(theta)[:, None] * np.stack([np.cos(phi), np.sin(phi)])[:, None]
    picture = 1.5 + np.stack([polar, *round_about], -1)
    path = tmp_path_factory.mktemp("maps") / "six.exr"
    import_module(f"{extension.__name__}.nfm_addon.images").write_linear(path, picture)
    return path


def test_same_picture_as_cycles(addon, blender, coarse_sphere, colourful, tmp_path):
    pytest.importorskip("mitsuba")
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
    theirs = mitsuba_sphere.render(diffuse, colourful, SIZE, 256, 0)
    material = blender.data.materials.new("matte")
    tree = addon("node_trees").empty_tree(material)
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs[0])
    sphere = coarse_sphere(256)
    view = sphere.SphereView(resolution=SIZE, samples=64, environment=colourful)
    scene = sphere.build_scene(material, view)
    addon("rendering").render_to_file(scene, tmp_path / "picture.exr")
    ours = addon("images").read_linear(tmp_path / "picture.exr")
    # the whole picture: silhouette, background and shading
    assert np.abs(theirs - ours).mean() < 0.04
    assert np.quantile(np.abs(theirs - ours), 0.98) < 0.2
    # and it would be another one the other way round
    assert np.abs(theirs - ours[:, ::-1]).max() > 0.4
    assert np.abs(theirs - ours[::-1]).max() > 0.4


def test_white_furnace():
    pytest.importorskip("mitsuba")
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
    picture = mitsuba_sphere.render(diffuse, None, SIZE, 16, 0)
    assert picture.mean() == pytest.approx(1, abs=0.01)
    np.testing.assert_allclose(picture[0, 0], 1)
