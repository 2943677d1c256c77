# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured materials of another file: linked, overridden, made local."""

import json

import pytest

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS


@pytest.fixture
def library(blender, addon, tmp_path):
    """A file with the object Ball, which has the material plastic."""
    item = addon("material").build(FittedMaterial("plastic", MODELS["plastic"]), "REFERENCE")
    mesh = blender.data.meshes.new("Ball")
    mesh.materials.append(item)
    blender.context.scene.collection.objects.link(blender.data.objects.new("Ball", mesh))
    path = tmp_path / "library.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return path


@pytest.fixture
def link(blender, library):
    """Link from the library into an empty scene; the datablocks by kind."""

    def from_file(**names):
        with blender.data.libraries.load(str(library), link=True) as (_, wanted):
            for kind, name in names.items():
                setattr(wanted, kind, [name])
        return [getattr(blender.data, kind)[name] for kind, name in names.items()]

    return from_file


@pytest.fixture
def local_object(blender, link):
    """An active object of this file with the linked material."""
    (linked,) = link(materials="plastic")
    mesh = blender.data.meshes.new("Here")
    mesh.materials.append(linked)
    return activate(blender, blender.data.objects.new("Here", mesh))


@pytest.fixture
def reopened(blender, tmp_path):
    """Save and open; the material of this file that Here has."""

    def again():
        path = tmp_path / "shot.blend"
        blender.ops.wm.save_as_mainfile(filepath=str(path))
        blender.ops.wm.open_mainfile(filepath=str(path))
        return blender.data.objects["Here"].active_material

    return again


@pytest.fixture
def source(addon):
    return lambda item: addon("node_group").find_script_node(item).script.as_string()


def activate(blender, item):
    blender.context.scene.collection.objects.link(item)
    blender.context.view_layer.objects.active = item
    return item


def test_linked_material_cannot_be_edited_and_says_what_to_do(blender, local_object, addon):
    linked = local_object.active_material
    assert addon("live").flush() == []
    with pytest.raises(RuntimeError, match="makes a linked one editable"):
        blender.ops.nfm.reset_edits()
    with pytest.raises(addon("errors").ShaderError, match="make a library override first"):
        addon("editing").own_group(linked)


def test_override_keeps_its_edits(blender, local_object, addon, source, reopened):
    linked = local_object.active_material
    before = source(linked)
    blender.ops.nfm.make_editable()
    item = local_object.active_material
    assert item.override_library.reference == linked
    assert not addon("live").flush()  # the copy of the group shows what the material asks for
    item.nfm.edit.lobe_1.width = 2.0
    item.nfm.edit.lobe_2.gain = 0.5
    item.nfm.mute[2] = True
    item.nfm.sampling = "COSINE"
    edited = source(item)
    assert edited != before
    item = reopened()
    assert item.override_library
    assert not addon("live").flush()
    assert source(item) == edited
    assert source(item.override_library.reference) == before
    edit = item.nfm.edit
    assert (edit.lobe_1.width, edit.lobe_2.gain, item.nfm.mute[2]) == (2.0, 0.5, True)
    group = addon("editing").group_of(item)
    assert group.nodes["Lobe 2 Gain"].inputs[1].default_value[0] == 0.5
    assert "NFM Mute 3" in group.nodes


def test_override_keeps_its_curves(blender, local_object, addon, source, reopened):
    blender.ops.nfm.make_editable()
    item = local_object.active_material
    before = source(item)
    mapping = addon("editing").group_of(item).nodes["Lobe 2 D"].mapping
    mapping.curves[0].points[4].location.y -= 0.1
    mapping.update()
    addon("live").flush()
    edited = source(item)
    assert edited != before
    item = reopened()
    assert not addon("live").flush()
    assert source(item) == edited


def test_override_made_by_hand_gets_its_group_with_the_first_edit(local_object, addon, source):
    """Blender > ID Data > Make Library Override."""
    linked = local_object.active_material
    item = linked.override_create(remap_local_usages=True)
    assert local_object.active_material == item
    assert not addon("live").flush()
    assert addon("editing").group_of(item).library
    before = source(linked)
    item.nfm.edit.lobe_1.gain = 0.5
    assert addon("live").flush() == [item]
    assert not addon("editing").group_of(item).library
    item.nfm.edit.lobe_1.width = 2.0
    assert addon("live").flush() == [item]
    assert source(linked) == before != source(item)


def test_a_group_that_is_overridden_as_well(local_object, addon, source):
    linked = local_object.active_material
    item = linked.override_create(remap_local_usages=True)
    node = addon("node_group").find_group_node(item)
    node.node_tree = node.node_tree.override_create()
    item.nfm.edit.lobe_1.width = 2.0
    assert addon("live").flush() == [item]
    group = addon("editing").group_of(item)
    assert not group.library
    assert not group.override_library
    assert source(linked) != source(item)


def test_material_in_a_linked_mesh(blender, link):
    (mesh,) = link(meshes="Ball")
    target = activate(blender, blender.data.objects.new("Here", mesh))
    blender.ops.nfm.make_editable()
    assert target.material_slots[0].link == "OBJECT"
    assert target.active_material.override_library
    assert mesh.materials[0].library


def test_object_that_is_linked_too(blender, link):
    (ball,) = link(objects="Ball")
    activate(blender, ball)
    with pytest.raises(RuntimeError, match="make a library override of it first"):
        blender.ops.nfm.make_editable()


def test_overridden_object_and_its_material(blender, link, addon, source):
    """The whole hierarchy, as Object > Library Override > Make does it."""
    (ball,) = link(objects="Ball")
    activate(blender, ball)
    ball.override_hierarchy_create(blender.context.scene, blender.context.view_layer)
    target = next(item for item in blender.data.objects if item.override_library)
    blender.context.view_layer.objects.active = target
    before = source(target.active_material)
    blender.ops.nfm.make_editable()
    item = target.active_material
    assert item.override_library
    item.nfm.edit.lobe_1.width = 2.0
    addon("live").flush()
    assert source(item) != before


def test_material_made_local_has_a_linked_group_until_it_is_edited(local_object, addon, source):
    linked = local_object.active_material
    item = linked.make_local()
    before = source(item)
    item.nfm.edit.lobe_1.width = 2.0
    assert addon("live").flush() == [item]
    assert not addon("editing").group_of(item).library
    assert source(item) != before


def test_override_takes_another_model(blender, local_object, reopened, tmp_path):
    blender.ops.nfm.make_editable()
    path = tmp_path / "metal.nfm.json"
    parameter_file.save(path, FittedMaterial("metal", MODELS["metal"]))
    blender.ops.nfm.replace_measurement(filepath=str(path))
    item = reopened()
    assert json.loads(item.nfm.parameters)["name"] == "metal"


def test_editable_materials_are_left_alone(blender, addon):
    item = addon("material").build(FittedMaterial("plastic", MODELS["plastic"]), "REFERENCE")
    mesh = blender.data.meshes.new("Here")
    mesh.materials.append(item)
    activate(blender, blender.data.objects.new("Here", mesh))
    with pytest.raises(RuntimeError, match="can be edited already"):
        blender.ops.nfm.make_editable()
