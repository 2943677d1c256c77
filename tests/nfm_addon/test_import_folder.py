# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of measurements as an asset library: at once, and beside the interface."""

import importlib
import json
import time

import pytest

from fitter.formats import parameter_file
from tests import rgl_files
from tests.nfm_addon.fitting.conftest import SHORT_FITS


@pytest.fixture(scope="module")
def content():
    return rgl_files.tensor_bytes(rgl_files.fields_of(rgl_files.glossy, n=8, n_theta=3))


@pytest.fixture
def folder(tmp_path, content):
    """Two measurements, and one that is cut off."""
    folder = tmp_path / "my: database"
    folder.mkdir()
    (folder / "pearl.bsdf").write_bytes(content)
    (folder / "gem.bsdf").write_bytes(content + b"\0")
    (folder / "broken.bsdf").write_bytes(content[:300])
    return folder


@pytest.fixture
def short(extension, monkeypatch, addon):
    """Fits that take a moment, in this process and in others."""
    quality = importlib.import_module(f"{extension.__name__}.fitter.fitting.quality")
    for name in ("draft", "standard"):
        monkeypatch.setitem(
            quality.QUALITIES, name, quality.Quality(1, 1, 0, 1, 0, 1, 0, 0, 45, 90, 0, 90)
        )
    monkeypatch.setattr(addon("fitting.process"), "CODE", SHORT_FITS)


@pytest.fixture
def import_folder(blender, short, folder, tmp_path):
    libraries = blender.context.preferences.filepaths.asset_libraries
    before = len(libraries)

    def run(**options):
        return blender.ops.nfm.import_folder(
            directory=f"{folder}/", output=str(tmp_path / "out"), **options
        )

    yield run
    while len(libraries) > before:
        libraries.remove(libraries[-1])


def summary(blender):
    return blender.data.texts["Folder my- database"].as_string()


def test_at_once(import_folder, blender, tmp_path, addon, all_names):
    before = all_names()
    assert import_folder() == {"FINISHED"}
    output = tmp_path / "out"
    assert {path.name for path in output.iterdir()} == {
        *("gem.blend", "gem.nfm.json", "pearl.blend", "pearl.nfm.json"),
        *("summary.json", "blender_assets.cats.txt"),
    }
    lines = summary(blender).splitlines()
    assert lines[0].startswith("broken.nfm.json  failed  broken.bsdf: ")
    assert lines[1].startswith("gem.nfm.json     fitted  objective ")
    assert lines[-1] == "2 fitted, 0 kept, 1 failed"
    rows = json.loads((output / "summary.json").read_text())
    assert [row["status"] for row in rows] == ["failed", "fitted", "fitted"]
    # nothing but the table is new in the file that is open
    assert all_names() == before | {"texts": ["Folder my- database"]}
    entry = blender.context.preferences.filepaths.asset_libraries[-1]
    assert (entry.name, entry.path) == ("my- database", str(output))
    with blender.data.libraries.load(str(output / "gem.blend"), assets_only=True) as (_, here):
        here.materials = ["gem"]
    data = here.materials[0].asset_data
    assert data.catalog_id == addon("asset_files").catalogue_id("my- database")
    assert "my- database" in (output / "blender_assets.cats.txt").read_text()


def test_the_next_time_goes_on(import_folder, blender, tmp_path, folder):
    import_folder(show=False)
    output = tmp_path / "out"
    (output / "gem.blend").unlink()
    inodes = {path.name: path.stat().st_ino for path in output.glob("pearl.*")}
    (folder / "broken.bsdf").unlink()
    import_folder(show=False)
    assert summary(blender).splitlines()[-1] == "0 fitted, 2 kept, 0 failed"
    assert (output / "gem.blend").exists()
    assert {path.name: path.stat().st_ino for path in output.glob("pearl.*")} == inodes
    # another quality is another fit
    import_folder(show=False, quality="DRAFT")
    assert summary(blender).splitlines()[-1] == "2 fitted, 0 kept, 0 failed"


@pytest.fixture
def beside(addon, blender, import_folder, folder, tmp_path):
    """Ask for the folder as in a window; the queue."""
    queue = addon("fitting.queue").queue
    module, jobs = addon("fitting.folder"), importlib.import_module
    batch = jobs(addon("fitting.folder").batch.__name__)

    def run():
        output = tmp_path / "out"
        output.mkdir(exist_ok=True)
        whole = module.FolderImport(folder.name, output, batch.jobs_of(folder, output), True)
        for job in whole.jobs:
            place = module.FolderItem(whole, job)
            queue.add(addon("fitting.queue").Job(str(job.path), "standard", place, "srgb-140"))
        return queue

    yield run
    queue.forget_all()


def pump(queue, done):
    end = time.monotonic() + 300
    while not done():
        assert time.monotonic() < end
        queue.pump()
        time.sleep(0.02)


def test_beside_the_interface(beside, blender, tmp_path):
    queue = beside()
    pump(queue, lambda: not queue.jobs)
    assert summary(blender).splitlines()[-1] == "2 fitted, 0 kept, 1 failed"
    levels = [level for level, text in queue.messages if text]
    assert levels == ["WARNING", "INFO"]  # an ERROR would stop whoever works
    assert queue.messages[-1][1].startswith("my: database: 2 fitted, 0 kept, 1 failed; the table")
    assert (tmp_path / "out" / "pearl.blend").exists()
    assert parameter_file.load(tmp_path / "out" / "pearl.nfm.json").fit["quality"] == "standard"
    queue.messages.clear()
    pump(beside(), lambda: not queue.jobs)
    assert summary(blender).splitlines()[-1] == "0 fitted, 2 kept, 1 failed"


def test_cancelling_stops_the_whole_folder(beside, blender, tmp_path):
    queue = beside()
    pump(queue, lambda: len(queue.jobs) == 1)
    queue.cancel(queue.jobs[0])
    assert queue.jobs == []
    assert summary(blender).splitlines()[-1] == "1 fitted, 0 kept, 1 failed"
    assert not (tmp_path / "out" / "pearl.blend").exists()


def test_cancelling_all_says_it_once(beside, blender):
    queue = beside()
    queue.messages.clear()
    assert blender.ops.nfm.cancel_fit(all=True) == {"FINISHED"}
    texts = [text for _, text in queue.messages if "the table" in text]
    assert len(texts) == 1


def test_a_folder_without_measurements(blender, tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(RuntimeError, match="empty: holds no file with the suffix"):
        blender.ops.nfm.import_folder(directory=str(empty), output=str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()
