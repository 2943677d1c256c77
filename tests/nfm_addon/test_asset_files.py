# SPDX-License-Identifier: GPL-3.0-or-later
"""Assets as files: written without a trace, appended with all that renders and edits them."""

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS

ICON = np.linspace(0, 1, 16 * 16 * 4, dtype=np.float32).reshape(16, 16, 4)


@pytest.fixture
def write(addon, tmp_path):
    """Write a material as an asset; its file."""
    files, assets = addon("asset_files"), addon("assets")

    def run(name="Blue", model=None, **metadata):
        path = tmp_path / f"{name}.blend"
        metadata = {"description": "about", "catalogue": "Measured/Metal"} | metadata
        fitted = FittedMaterial(name, MODELS["plastic"] if model is None else model)
        files.write_material(path, fitted, ICON, assets.Metadata(**metadata))
        return path

    return run


@pytest.fixture
def append(blender):
    """What dropping an asset does: copy its datablocks here."""

    def run(path, link=False):
        with blender.data.libraries.load(str(path), link=link, assets_only=True) as (there, here):
            here.materials = list(there.materials)
        (material,) = here.materials
        return material

    return run


def test_nothing_of_it_stays(write, all_names, blender):
    blender.data.materials.new("Blue")
    before = all_names()
    path = write()
    assert all_names() == before
    assert [item.name for item in path.parent.iterdir()] == ["Blue.blend"]


def test_the_asset_keeps_its_name_though_another_has_it(write, append, blender):
    blender.data.materials.new("Blue")
    path = write()
    with blender.data.libraries.load(str(path), assets_only=True) as (there, _):
        assert there.materials == ["Blue"]


def test_what_the_asset_browser_shows(write, append, addon):
    material = append(write(author="somebody", license="CC0 1.0", tags=("synthetic", "", "fabric")))
    data = material.asset_data
    assert (data.description, data.author, data.license) == ("about", "somebody", "CC0 1.0")
    assert [tag.name for tag in data.tags] == ["synthetic", "fabric"]
    assert data.catalog_id == addon("asset_files").catalogue_id("Measured/Metal")
    assert tuple(material.preview.image_size) == (16, 16)


@pytest.mark.osl
@pytest.mark.parametrize("model", [MODELS["plastic"], ANISOTROPIC_MODELS["pile"]])
def test_an_appended_asset_is_whole(write, append, addon, model, sphere_scene, render):
    path = write("Thing", model)
    material = append(path)
    assert not material.library
    assert addon("material").find_script_node(material).bytecode
    fitted = addon("material").fitted_material(material)
    np.testing.assert_array_equal(fitted.model.ndf, model.ndf)
    picture = render(sphere_scene(material))
    assert 0.05 < picture[12, 12].mean() < 3
    fresh = addon("material").build(FittedMaterial("Thing", model))
    np.testing.assert_array_equal(picture, render(sphere_scene(fresh)))


@pytest.mark.osl
def test_two_copies_diverge(write, append, addon):
    path = write()
    first, second = append(path), append(path)
    editing, find = addon("editing"), addon("material").find_script_node
    before = find(second).bytecode_hash
    first.nfm.edit.lobe_1.width = 3
    editing.refresh(first)
    editing.refresh(second)
    assert find(first).bytecode_hash != before
    assert find(second).bytecode_hash == before
    copy = second.copy()
    copy.nfm.edit.lobe_1.width = 2
    editing.refresh(copy)
    assert find(second).bytecode_hash == before != find(copy).bytecode_hash


def test_a_linked_asset_renders_and_is_not_edited(write, append, addon, sphere_scene, render):
    material = append(write(), link=True)
    assert material.library
    assert not addon("editing").has_own_nodes(material)
    fresh = addon("material").build(FittedMaterial("Blue", MODELS["plastic"]))
    np.testing.assert_array_equal(render(sphere_scene(material)), render(sphere_scene(fresh)))


@pytest.mark.osl
def test_an_asset_made_without_osl_is_compiled_when_it_is_appended(
    write, append, addon, monkeypatch
):
    script_node = addon("script_node")
    with monkeypatch.context() as patch:
        patch.setattr(script_node, "has_osl", lambda: False)
        path = write()
    material = append(path)
    assert addon("material").find_script_node(material).bytecode


def test_a_folder_that_cannot_be_written(write, addon, tmp_path, all_names):
    before = all_names()
    files, assets = addon("asset_files"), addon("assets")
    path = tmp_path / "no such folder" / "x.blend"
    fitted = FittedMaterial("x", MODELS["plastic"])
    with pytest.raises(ValueError, match=r"^x\.blend: cannot be written .*choose another folder"):
        files.write_material(path, fitted, ICON, assets.Metadata())
    assert all_names() == before


def test_catalogues(addon, tmp_path):
    files = addon("asset_files")
    path = tmp_path / files.CATALOGUES
    files.write_catalogues(tmp_path, ["Measured/Metal", "Measured/Cloth"])
    own = "11111111-2222-3333-4444-555555555555:Mine:Mine\n"
    path.write_text(path.read_text() + own)
    files.write_catalogues(tmp_path, ["Synthetic", "Measured/Metal"])
    lines = [line for line in path.read_text().splitlines() if line and line[0] != "#"]
    assert lines[0] == "VERSION 1"
    paths = [line.split(":")[1] for line in lines[1:]]
    assert sorted(paths) == ["Measured", "Measured/Cloth", "Measured/Metal", "Mine", "Synthetic"]
    assert len({line.split(":")[0] for line in lines}) == len(lines)


def test_a_picture_is_read_as_it_is_shown(addon, tmp_path, blender):
    image = blender.data.images.new("x", 4, 3, alpha=True)
    pixels = (np.arange(48) / 47).astype(np.float32)
    image.pixels.foreach_set(pixels)
    image.file_format, image.filepath_raw = "PNG", str(tmp_path / "x.png")
    image.save()
    found = addon("asset_files").read_picture(tmp_path / "x.png")
    np.testing.assert_allclose(found.ravel(), pixels, atol=0.5 / 255 + 1e-6)
    with pytest.raises(ValueError, match="no such picture"):
        addon("asset_files").read_picture(tmp_path / "y.png")


def test_metadata_of_an_import(addon, blender):
    material = addon("material").build(FittedMaterial("Blue", MODELS["plastic"]))
    material.nfm.source, material.nfm.source_format = "blue.binary", "merl"
    addon("assets").mark(material, replace_alpha(ICON))
    assert material.asset_data.description == "Measured BRDF: blue.binary"
    assert {tag.name for tag in material.asset_data.tags} == {"measured", "merl"}


def replace_alpha(icon):
    icon = icon.copy()
    icon[..., 3] = 1
    return icon
