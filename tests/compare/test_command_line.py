# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from compare import command_line, pool, report
from compare.command_line import main
from compare.store import Store
from fitter.errors import NfmError
from fitter.formats import merl, utia


@pytest.fixture(scope="module")
def files(tmp_path_factory, two_lobes):
    """Two files of different content."""
    folder = tmp_path_factory.mktemp("measured")
    paths = [folder / "copper.binary", folder / "tin.binary"]
    for path, factor in zip(paths, (1, 2), strict=True):
        merl.write(path, factor * two_lobes.f_r, two_lobes.valid)
    yield paths
    for path in paths:
        path.unlink()


@pytest.fixture
def graded(monkeypatch, make_result):
    """Files that were graded, by a stand-in for the pool; no scenes and no figures."""
    names = []

    def run(tasks, settings, scenes, store, jobs):
        assert jobs > 0
        for n, task in enumerate(tasks):
            names.append(task.path.name)
            store.save(task.key, make_result(task.path.stem, n_scenes=0))
            yield 4 * n + 4, task

    monkeypatch.setattr(pool, "run", run)
    monkeypatch.setattr(command_line, "scene_sources", lambda environment: ([], ["No scenes."]))
    monkeypatch.setattr(report, "pictures", lambda content: [])
    return names


def fails(capsys, *words):
    out, err = capsys.readouterr()
    assert out == ""
    last = err.splitlines()[-1]
    assert last.startswith("nfm: ")
    assert all(word in last for word in words)
    assert "Traceback" not in err


def test_anisotropic_files_are_refused(graded, files, tmp_path, capsys):
    cloth = tmp_path / "cloth.bin"
    utia.write_bin(cloth, np.full((6, 48, 6, 48, 3), 0.3))
    assert main([str(files[0]), str(cloth), "--report", str(tmp_path / "report")]) == 1
    fails(capsys, "cloth.bin", "anisotropic")
    assert graded == []


def test_report_is_written(graded, files, tmp_path, capsys):
    folder, table = tmp_path / "new" / "report", tmp_path / "table.md"
    arguments = [*map(str, files), "--report", str(folder), "--markdown", str(table)]
    assert main([*arguments, "--note", "Synthetic data."]) == 0
    assert graded == ["copper.binary", "tin.binary"]
    out, err = capsys.readouterr()
    assert out.splitlines()[-1] == f"written to {folder / 'report.html'}"
    assert err.splitlines() == [
        "compare: reading",
        "compare: 0 of 2 materials",
        "compare: 1 of 2 materials",
        "compare: 2 of 2 materials",
        "compare: writing the report",
    ]
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert all(f"<td>{name}</td>" in text for name in ("copper", "tin"))
    assert "<p>Synthetic data.</p>" in text
    assert table.read_text(encoding="utf-8") == (folder / "report.md").read_text(encoding="utf-8")


def test_finished_materials_are_not_fitted_again(graded, files, tmp_path, capsys):
    first, both = [str(files[0])], [*map(str, files)]
    assert main([*first, "--report", str(tmp_path)]) == 0
    assert main([*both, "--report", str(tmp_path)]) == 0
    assert graded == ["copper.binary", "tin.binary"]
    assert "compare: 1 of 2 materials" in capsys.readouterr().err
    assert main([*both, "--report", str(tmp_path)]) == 0
    assert len(graded) == 2
    # other settings and other folders are other results
    assert main([*first, "--report", str(tmp_path), "--weight", "log"]) == 0
    assert main([*first, "--report", str(tmp_path), "--quality", "draft"]) == 0
    assert main([*first, "--report", str(tmp_path), "--golden-section"]) == 0
    assert main([*first, "--report", str(tmp_path / "other")]) == 0
    assert len(graded) == 6


def test_damaged_result_is_fitted_again(graded, files, tmp_path):
    arguments = [str(files[0]), "--report", str(tmp_path)]
    assert main(arguments) == 0
    (result,) = (tmp_path / "results").iterdir()
    result.write_bytes(result.read_bytes()[:100])
    assert main(arguments) == 0
    assert len(graded) == 2


def test_what_was_finished_before_an_error_stays(graded, files, tmp_path, capsys, monkeypatch):
    whole = pool.run

    def stopped(tasks, *rest):
        yield from whole(tasks[:1], *rest)
        raise NfmError("tin.binary: became shorter")

    arguments = [*map(str, files), "--report", str(tmp_path)]
    monkeypatch.setattr(pool, "run", stopped)
    assert main(arguments) == 1
    fails(capsys, "tin.binary")
    assert not (tmp_path / "report.html").exists()
    monkeypatch.setattr(pool, "run", whole)
    assert main(arguments) == 0
    assert graded == ["copper.binary", "tin.binary"]


def test_a_file_given_twice_counts_once(graded, files, tmp_path):
    assert main([str(files[0]), str(files[0]), "--report", str(tmp_path)]) == 0
    assert graded == ["copper.binary"]


def test_a_bad_file_is_found_before_anything_is_fitted(graded, files, tmp_path, capsys):
    bad = tmp_path / "bad.binary"
    bad.write_bytes(b"not a MERL file")
    arguments = [str(files[0]), str(bad), "--report", str(tmp_path / "r")]
    assert main(arguments) == 1
    fails(capsys, "bad.binary", "MERL")
    assert main([str(tmp_path / "none.binary"), "--report", str(tmp_path / "r")]) == 1
    fails(capsys, "none.binary: no such file")
    assert graded == []


def test_folder_that_cannot_be_made(graded, files, tmp_path, capsys):
    (tmp_path / "taken").write_text("")
    assert main([str(files[0]), "--report", str(tmp_path / "taken")]) == 1
    fails(capsys, "taken: cannot be made a folder")
    table = str(tmp_path / "no" / "table.md")
    assert main([str(files[0]), "--report", str(tmp_path), "--markdown", table]) == 1
    fails(capsys, "table.md: there is no such folder")
    assert graded == []


def test_curves_must_name_a_material(graded, files, tmp_path, capsys):
    arguments = [str(files[0]), "--report", str(tmp_path), "--curves", "copper"]
    assert main(arguments) == 0
    capsys.readouterr()
    assert main([*arguments, "tin"]) == 1
    fails(capsys, "--curves tin", "copper")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["a.binary"],
        ["--report", "r"],
        ["a.binary", "--report", "r", "--jobs", "0"],
        ["a.binary", "--report", "r", "--jobs", "many"],
        ["a.binary", "--report", "r", "--weight", "none"],
    ],
)
def test_bad_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "usage: nfm compare" in capsys.readouterr().err


# --- scenes ---


@pytest.fixture
def maps(monkeypatch, tmp_path):
    """Maps and a mesh in a folder that stands for the shared one."""
    paths = {name: tmp_path / f"{name.lower()}.file" for name in ("GRACE", "GROVE", "BUDDHA")}
    for name, path in paths.items():
        path.write_text("")
        monkeypatch.setattr(command_line.shared_data, name, path)
    read = []
    monkeypatch.setattr(
        command_line, "_read_map", lambda path: read.append(path.name) or np.ones((64, 128, 3))
    )
    triangles = np.zeros((3, 3)), np.zeros((1, 3), int)
    monkeypatch.setattr(command_line, "read_ply", lambda path: triangles)
    return paths, read


def test_scenes_of_the_paper(maps):
    sources, notes = command_line.scene_sources(None)
    assert [source.name for source in sources] == ["sphere in Grace", "Buddha in Grove"]
    assert [source.triangles is None for source in sources] == [True, False]
    assert maps[1] == ["grace.file", "grove.file"]
    assert notes == []


@pytest.mark.parametrize(
    ("missing", "left"),
    [
        ("GRACE", ["Buddha in Grove"]),
        ("GROVE", ["sphere in Grace"]),
        ("BUDDHA", ["sphere in Grace"]),
    ],
)
def test_scenes_whose_parts_are_missing_are_skipped_and_told(maps, missing, left):
    maps[0][missing].unlink()
    sources, notes = command_line.scene_sources(None)
    assert [source.name for source in sources] == left
    assert len(notes) == 1
    assert f"{missing.lower()}.file" in notes[0]
    assert "--env" in notes[0]


def test_a_map_of_ones_own(maps, tmp_path):
    own = tmp_path / "studio.hdr"
    sources, notes = command_line.scene_sources(own)
    assert [source.name for source in sources] == ["sphere in studio", "Buddha in studio"]
    maps[0]["GRACE"].unlink()
    maps[0]["BUDDHA"].unlink()
    sources, notes = command_line.scene_sources(own)
    assert [source.name for source in sources] == ["sphere in studio"]
    assert len(notes) == 1


def test_a_map_that_cannot_be_read(graded, files, tmp_path, capsys, monkeypatch):
    class Images:
        @staticmethod
        def read_linear(path):
            raise ValueError(f"{path.name}: no such image; check the path")

    monkeypatch.undo()
    monkeypatch.setattr(command_line, "_images", lambda: Images)
    arguments = [str(files[0]), "--report", str(tmp_path), "--env", str(tmp_path / "none.hdr")]
    assert main(arguments) == 1
    fails(capsys, "none.hdr: no such image")


def test_maps_are_read_by_blender(addon, tmp_path, monkeypatch):
    pixels = np.random.default_rng(0).random((64, 128, 3), dtype=np.float32)
    addon("images").write_linear(tmp_path / "map.exr", pixels)
    monkeypatch.setattr(command_line, "_images", lambda: addon("images"))
    np.testing.assert_allclose(command_line._read_map(tmp_path / "map.exr"), pixels, rtol=1e-6)


def test_results_are_kept_in_the_folder(graded, files, tmp_path):
    assert main([str(files[0]), "--report", str(tmp_path)]) == 0
    (result,) = (tmp_path / "results").iterdir()
    assert Store(tmp_path / "results").load(result.stem).name == "copper"
