# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written where it cannot be: the old file stays, nothing else is left, and it is told.

A full disk is a limit on the size of files, which the kernel keeps: writing fails in the middle,
in Python and in Blender alike.
"""

from contextlib import contextmanager

import pytest

from tests import rights

resource = pytest.importorskip("resource", reason="limits of a process are a matter of Unix")

OLD = b"what was there before"


@pytest.fixture
def material(addon, fitted):
    return addon("material").build(fitted)


@pytest.fixture
def writers(addon, blender, material, mesh_object, sphere_scene):
    """Ways to write a file, by its suffix; all of them overwrite."""
    nfm = blender.ops.nfm
    mesh_object().data.materials.append(material)

    def export(path):
        nfm.export_parameters(filepath=str(path))

    def presets(path):
        nfm.save_edits(filepath=str(path))

    def measurement(path):
        nfm.export_measurement(filepath=str(path))

    def picture(path):
        addon("rendering").render_to_file(sphere_scene(material), path)

    def asset(path):
        addon("asset_files")._write(path, material)

    def catalogues(path):
        addon("asset_files").write_catalogues(path.parent, ["Measured/Metal"])

    return {
        "export.nfm.json": export,
        "preset.nfm.json": presets,
        "export.binary": measurement,
        "picture.exr": picture,
        "picture.png": picture,
        "asset.blend": asset,
        "blender_assets.cats.txt": catalogues,
    }


NAMES = (
    *("export.nfm.json", "preset.nfm.json", "export.binary", "picture.exr", "picture.png"),
    *("asset.blend", "blender_assets.cats.txt"),
)


@contextmanager
def full_disk():
    """No file grows beyond a few bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("there_before", [True, False])
def test_full_disk(name, there_before, writers, tmp_path):
    path = tmp_path / name
    if there_before:
        path.write_bytes(OLD)
    with full_disk(), pytest.raises((ValueError, OSError, RuntimeError)) as caught:
        writers[name](path)
    assert name in str(caught.value)
    assert list(tmp_path.iterdir()) == [path] * there_before
    if there_before:
        assert path.read_bytes() == OLD


@pytest.mark.parametrize("name", NAMES)
def test_read_only_folder(name, writers, tmp_path):
    folder = tmp_path / "of others"
    folder.mkdir()
    path = folder / name
    path.write_bytes(OLD)
    with (
        rights.without(folder, 0o555),
        pytest.raises((ValueError, OSError, RuntimeError)) as caught,
    ):
        writers[name](path)
    assert name in str(caught.value)
    assert list(folder.iterdir()) == [path]
    assert path.read_bytes() == OLD


@pytest.mark.osl
def test_full_disk_where_shaders_are_compiled(addon, all_names, fitted):
    """Cycles compiles by way of temporary files."""
    before = all_names()
    with full_disk(), pytest.raises(addon("errors").ShaderError, match="folder of temporary files"):
        addon("material").build(fitted)
    assert all_names() == before
