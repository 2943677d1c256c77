# SPDX-License-Identifier: GPL-3.0-or-later
"""The material library as the user installs it."""

import pytest


@pytest.fixture
def library(addon, monkeypatch, extension, tmp_path):
    """The module, with two materials only and an empty place to install them."""
    import importlib

    module = addon("material_library")
    entries = importlib.import_module(f"{extension.__name__}.fitter.jobs.library")
    two = [e for e in entries.ENTRIES if e.key in ("satin-gold", "colodur_napoli_4f")]
    monkeypatch.setattr(entries, "ENTRIES", two)
    monkeypatch.setattr(addon("operators.install_library"), "ENTRIES", two)
    monkeypatch.setattr(module, "installed_folder", lambda: tmp_path / "library")
    yield module
    module.remove()


def libraries(blender):
    return {entry.path: entry for entry in blender.context.preferences.filepaths.asset_libraries}


def test_nothing_is_installed_unasked(library, blender):
    assert library.registered() is None
    assert not library.installed_folder().exists()


def test_install_and_remove(library, blender, all_names, addon):
    before, others = all_names(), set(libraries(blender))
    assert blender.ops.nfm.install_library() == {"FINISHED"}
    assert all_names() == before
    folder = library.installed_folder()
    assert {path.name for path in folder.iterdir()} == {
        "satin-gold.blend",
        "colodur_napoli_4f.blend",
        "blender_assets.cats.txt",
    }
    (path,) = set(libraries(blender)) - others
    assert path == str(folder)
    entry = libraries(blender)[path]
    # a linked or packed material cannot be edited
    assert (entry.name, entry.import_method) == ("Measured Materials", "APPEND")
    text = (folder / "blender_assets.cats.txt").read_text()
    with blender.data.libraries.load(str(folder / "satin-gold.blend"), assets_only=True) as (
        there,
        here,
    ):
        assert there.materials == ["Satin Gold (synthetic)"]
        here.materials = there.materials
    gold = here.materials[0]
    assert f"{gold.asset_data.catalog_id}:Synthetic/Metal:" in text
    assert gold.asset_data.license == "CC0 1.0"
    assert "not measured" in gold.asset_data.description
    assert tuple(gold.preview.image_size) == (192, 192)
    assert gold.nfm.sampling == "NATIVE"

    assert blender.ops.nfm.install_library() == {"FINISHED"}  # again, as after an update
    assert set(libraries(blender)) - others == {path}
    assert blender.ops.nfm.remove_library() == {"FINISHED"}
    assert set(libraries(blender)) == others
    assert not folder.exists()
    assert not blender.ops.nfm.remove_library.poll()


def test_a_damaged_add_on_is_said(library, blender, monkeypatch, tmp_path):
    monkeypatch.setattr(library, "SHIPPED", tmp_path)
    monkeypatch.setattr(library.parameters_of, "__defaults__", (tmp_path,))
    with pytest.raises(RuntimeError, match=r"\.nfm\.json: no such file"):
        blender.ops.nfm.install_library()
    assert library.registered() is None
