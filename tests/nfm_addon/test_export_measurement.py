# SPDX-License-Identifier: GPL-3.0-or-later
"""Edited materials as MERL and UTIA files, by the operator and the command line."""

import numpy as np
import pytest

from fitter.command_line import main as main_without_blender
from fitter.editing.edit_document import EditDocument
from fitter.formats import export as exporting
from fitter.formats import merl, parameter_file, utia
from fitter.formats.parameter_file import FittedMaterial
from fitter.geometry import directions_from_rusinkiewicz
from fitter.grading import metrics
from tests.independent_readers import merl_look_up, utia_look_up
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture
def build(addon, mesh_object):
    """A measured material on the active object."""

    def make(model=MODELS["paint"]):
        material = addon("material").build(FittedMaterial("thing", model), "REFERENCE")
        mesh_object().data.materials.append(material)
        return material

    return make


def edit(blender, addon, material):
    """Something of everything that changes how a material looks."""
    if material.nfm.edit.drawn:
        mapping = addon("editing").group_of(material).nodes["Lobe 1 D"].mapping
        mapping.curves[0].points[3].location[1] -= 0.15
        mapping.update()
    material.nfm.edit.lobe_2.gain = 2
    material.nfm.edit.edge_strength = 0.5
    material.nfm.edit.diffuse_saturation = 0.5
    material.nfm.mute[2] = True
    sockets = addon("material").find_group_node(material).inputs
    sockets["Lobe 1 Scale"].default_value = (0.5, 0.25, 1, 1)
    sockets["Diffuse"].default_value = (0.3, 0.2, 0.1, 1)
    addon("editing").refresh(material)


def export(blender, path, **options):
    assert blender.ops.nfm.export_measurement(filepath=str(path), **options) == {"FINISHED"}


def test_what_is_exported_is_what_is_rendered(blender, addon, build, sphere_scene, render):
    """Pictures of the edited material and of its numbers alone: curves, sliders, sockets, mute."""
    material = build()
    untouched = render(sphere_scene(material, samples=64)).mean((0, 1))
    edit(blender, addon, material)
    wanted = render(sphere_scene(material, samples=64)).mean((0, 1))
    model = addon("editing.rendered_model").rendered_model(material)
    alone = addon("material").build(FittedMaterial("alone", model), "REFERENCE")
    np.testing.assert_allclose(
        render(sphere_scene(alone, samples=64)).mean((0, 1)), wanted, rtol=0.01
    )
    assert (np.abs(untouched / wanted - 1) > 0.05).any()


def test_merl_round_trip_of_an_edited_material(blender, addon, build, tmp_path):
    material = build()
    edit(blender, addon, material)
    path = tmp_path / "edited.binary"
    export(blender, path)
    model = addon("editing.rendered_model").rendered_model(material)
    measurement = merl.read(path)
    for h, d, p in ((3, 20, 90), (20, 5, 10), (40, 30, 170), (60, 40, 60)):
        angles = ((h + 0.5) ** 2 / 90**2 * np.pi / 2, np.radians(d + 0.5), np.radians(p + 0.5))
        wi, wo = (w[None] for w in directions_from_rusinkiewicz(*angles))
        assert min(wi[0, 2], wo[0, 2]) > 0
        wanted = model.f_r(wi, wo)[0]
        np.testing.assert_allclose(merl_look_up(path, *angles), wanted, rtol=1e-9)
        np.testing.assert_allclose(measurement.f_r[h, d, p], wanted, rtol=1e-9)
        assert not np.allclose(MODELS["paint"].f_r(wi, wo)[0], wanted, rtol=0.05)


def test_without_edits(blender, addon, build, tmp_path):
    material = build()
    edit(blender, addon, material)
    path = tmp_path / "fitted.binary"
    export(blender, path, edited=False)
    fresh = tmp_path / "fresh.binary"
    exporting.write(fresh, MODELS["paint"])
    assert path.read_bytes() == fresh.read_bytes()


def test_utia_round_trip_of_an_edited_anisotropic_material(blender, addon, build, tmp_path):
    material = build(ANISOTROPIC_MODELS["pile"])
    edit(blender, addon, material)
    path = tmp_path / "edited.bin"
    export(blender, path)
    model = addon("editing.rendered_model").rendered_model(material)
    measurement = utia.read_bin(path)
    for i, j, k, m in ((1, 3, 2, 40), (4, 20, 1, 20), (3, 0, 5, 24)):
        wi, wo = (polar(15 * t, 7.5 * p)[None] for t, p in ((i, j), (k, m)))
        wanted = model.f_r(wi, wo)[0]
        np.testing.assert_allclose(utia_look_up(path, i, j, k, m), wanted, rtol=1e-9)
        np.testing.assert_allclose(measurement.f_r[i, j, k, m], wanted, rtol=1e-9)


def polar(theta, phi):
    theta, phi = np.radians(theta), np.radians(phi)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def test_an_anisotropic_material_is_no_merl_file(blender, build, tmp_path):
    build(ANISOTROPIC_MODELS["pile"])
    with pytest.raises(RuntimeError, match=r"an anisotropic .* let it end in \.bin"):
        blender.ops.nfm.export_measurement(filepath=str(tmp_path / "x.binary"))
    assert list(tmp_path.iterdir()) == []


def test_linked_sockets_are_left_as_fitted(blender, addon, build, tmp_path):
    material = build()
    node = addon("material").find_group_node(material)
    color = material.node_tree.nodes.new("ShaderNodeRGB")
    for name in ("Diffuse", "Lobe 2 Scale"):
        material.node_tree.links.new(color.outputs[0], node.inputs[name])
    assert addon("editing.rendered_model").linked_colors(material) == ["Diffuse", "Lobe 2 Scale"]
    model = addon("editing.rendered_model").rendered_model(material)
    np.testing.assert_allclose(model.scale, MODELS["paint"].scale)
    np.testing.assert_allclose(model.diffuse, MODELS["paint"].diffuse, rtol=1e-6)


def test_needs_a_measured_material(blender, mesh_object):
    mesh_object(slots=1)
    assert not blender.ops.nfm.export_measurement.poll()


def test_the_verb_applies_the_edits_of_a_preset(blender, addon, build, tmp_path, extension):
    material = build()
    edit(blender, addon, material)
    preset = tmp_path / "preset.nfm.json"
    assert blender.ops.nfm.save_edits(filepath=str(preset)) == {"FINISHED"}
    assert parameter_file.load(preset).edits
    output, plain = tmp_path / "edited.binary", tmp_path / "plain.binary"
    main = addon("command_line").main
    names = {item.name for item in blender.data.materials}
    assert main(["export", str(preset), "-o", str(output)]) == 0
    assert main(["export", str(preset), "-o", str(plain), "--without-edits"]) == 0
    assert {item.name for item in blender.data.materials} == names
    # a preset holds curves and sliders, not the sockets of a node
    for name, socket in addon("material").find_group_node(material).inputs.items():
        if name.startswith("Lobe"):
            socket.default_value = (1, 1, 1, 1)
        if name == "Diffuse":
            socket.default_value = (*(np.pi * MODELS["paint"].diffuse), 1)
    material.nfm.mute[2] = False
    wanted = addon("editing.rendered_model").rendered_model(material)
    table = merl.read(output)
    np.testing.assert_allclose(
        table.f_r[table.valid], metrics.tabulate(wanted)[table.valid], rtol=1e-5
    )
    original = merl.read(plain)
    np.testing.assert_allclose(
        original.f_r[original.valid], metrics.tabulate(MODELS["paint"])[original.valid], rtol=1e-9
    )


def test_without_blender_a_preset_is_refused(tmp_path, capsys):
    preset = tmp_path / "preset.nfm.json"
    material = FittedMaterial("thing", MODELS["paint"], edits=EditDocument())
    parameter_file.save(preset, material)
    output = tmp_path / "x.binary"
    assert main_without_blender(["export", str(preset), "-o", str(output)]) == 1
    assert "thing: a preset with edits, whose curves only Blender can draw" in (
        capsys.readouterr().err
    )
    assert not output.exists()
