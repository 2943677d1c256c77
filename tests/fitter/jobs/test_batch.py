# SPDX-License-Identifier: GPL-3.0-or-later
import json
import tracemalloc

import pytest

from fitter import synthetic
from fitter.command_line import FAILED as FAILED_STATUS
from fitter.command_line import main
from fitter.errors import NfmError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs import batch
from fitter.jobs.batch import FAILED, FITTED, KEPT, Job, Settings
from tests import models, rgl_files

SETTINGS = Settings(quality="draft")


@pytest.fixture(scope="module")
def content():
    return rgl_files.tensor_bytes(rgl_files.fields_of(rgl_files.glossy, n=8, n_theta=3))


@pytest.fixture
def folder(tmp_path, content):
    """Two measurements, one damaged file, and files that are no measurements."""
    folder = tmp_path / "database"
    folder.mkdir()
    (folder / "pearl.bsdf").write_bytes(content)
    (folder / "gem.BSDF").write_bytes(content + b"\0")
    (folder / "broken.bsdf").write_bytes(content[:300])
    (folder / "README.txt").write_text("about")
    (folder / "sub").mkdir()
    return folder


@pytest.fixture
def quick(monkeypatch):
    """Fits that take no time, and the list of what was fitted."""
    done = []

    def fitted(measurement, **settings):
        done.append(measurement.source.file_name)
        figures = {"objective": 0.01, "mean_log_error": 0.1, **settings}
        figures |= {"encoding": getattr(measurement, "encoding", "")}
        return FittedMaterial("x", models.MODELS["matte"], measurement.source, figures)

    monkeypatch.setattr(batch, "fit_measurement", fitted)
    return done


def test_jobs(folder, tmp_path):
    jobs = batch.jobs_of(folder, tmp_path / "out")
    assert [job.path.name for job in jobs] == ["broken.bsdf", "gem.BSDF", "pearl.bsdf"]
    assert [job.output.name for job in jobs] == [
        "broken.nfm.json",
        "gem.nfm.json",
        "pearl.nfm.json",
    ]


def test_files_of_one_stem_do_not_overwrite_each_other(folder, tmp_path):
    (folder / "Pearl.binary").write_bytes(b"")
    names = [job.output.name for job in batch.jobs_of(folder, tmp_path)]
    assert "pearl.bsdf.nfm.json" in names
    assert "Pearl.binary.nfm.json" in names
    assert len({name.lower() for name in names}) == len(names) == 4


def test_folder_without_measurements(tmp_path):
    with pytest.raises(NfmError, match=r"holds no file with the suffix \.binary or"):
        batch.jobs_of(tmp_path, tmp_path)


def test_fits_once(folder, tmp_path, quick):
    job = Job(folder / "pearl.bsdf", tmp_path / "pearl.nfm.json")
    first, second = (batch.fit_one(job, SETTINGS) for _ in range(2))
    assert (first.status, second.status) == (FITTED, KEPT)
    assert second.fit == first.fit
    assert quick == ["pearl.bsdf"]
    assert parameter_file.load(job.output).source.format == "rgl"


def test_fits_again_what_has_changed(folder, tmp_path, quick, content):
    job = Job(folder / "pearl.bsdf", tmp_path / "pearl.nfm.json")
    batch.fit_one(job, SETTINGS)
    for settings in (Settings(quality="best"), Settings("log", "best"), Settings("log", "best", 0)):
        assert batch.fit_one(job, settings).status == FITTED
        assert batch.fit_one(job, settings).status == KEPT
    job.path.write_bytes(content + b"\0\0")
    assert batch.fit_one(job, settings).status == FITTED
    job.output.write_text(job.output.read_text()[:1000])  # as a crash of another program leaves it
    assert batch.fit_one(job, settings).status == FITTED
    assert len(quick) == 6


def test_encoding_of_utia_files_in_a_mixed_folder(folder, tmp_path, quick):
    """Files that have a choice are fitted again with another one; the others have none."""
    synthetic.write_sample(folder / "brass.bin", "brushed-brass")
    jobs = [Job(folder / name, tmp_path / f"{name}.nfm.json") for name in ("brass.bin", "gem.BSDF")]
    settings = [Settings(quality="draft", encoding=e) for e in (None, "linear", "srgb-140")]
    statuses = [[batch.fit_one(job, one).status for one in settings] for job in jobs]
    assert statuses == [[FITTED, KEPT, FITTED], [FITTED, KEPT, KEPT]]
    assert parameter_file.load(jobs[0].output).fit["encoding"] == "srgb-140"


def test_encoding_that_no_file_has(folder, tmp_path, quick):
    synthetic.write_sample(folder / "brass.bin", "brushed-brass")
    job = Job(folder / "brass.bin", tmp_path / "brass.nfm.json")
    outcome = batch.fit_one(job, Settings(encoding="rot13"))
    assert outcome.status == FAILED
    assert "encoding rot13, files of the format utia-bin have linear" in outcome.message


def test_failures_are_outcomes(folder, tmp_path, quick):
    broken = batch.fit_one(Job(folder / "broken.bsdf", tmp_path / "a.nfm.json"), SETTINGS)
    gone = batch.fit_one(Job(folder / "gone.bsdf", tmp_path / "a.nfm.json"), SETTINGS)
    nowhere = batch.fit_one(Job(folder / "pearl.bsdf", tmp_path / "no" / "a.nfm.json"), SETTINGS)
    assert [outcome.status for outcome in (broken, gone, nowhere)] == [FAILED] * 3
    assert "broken.bsdf: field" in broken.message
    assert "gone.bsdf: no such file" in gone.message
    assert "a.nfm.json: cannot be written" in nowhere.message


def test_memory_does_not_grow_with_the_files(folder, tmp_path, quick, content):
    """One measurement at a time, whatever their number; each is 35 MB."""
    jobs = []
    for number in range(4):
        path = folder / f"{number}.bsdf"
        path.write_bytes(content + bytes(number))
        jobs.append(Job(path, tmp_path / f"{number}.nfm.json"))

    def peak(some):
        tracemalloc.start()
        try:
            outcomes = [batch.fit_one(job, SETTINGS) for job in some]
            assert all(outcome.status == FITTED for outcome in outcomes)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    assert peak(jobs[1:]) < 1.1 * peak(jobs[:1])


def test_the_verb_in_two_processes(folder, tmp_path, capsys):
    """Real processes and fits: a summary, failures at the end, and nothing twice."""
    output = tmp_path / "fits"
    command = ["fit", str(folder), "--out", str(output), "--jobs", "2", "--quality", "draft"]
    assert main(command) == FAILED_STATUS
    printed = capsys.readouterr()
    assert "1 of 3 files could not be fitted" in printed.err
    assert "3 of 3 files" in printed.err
    assert "2 fitted, 0 kept, 1 failed" in printed.out
    for name in ("gem", "pearl"):
        assert parameter_file.load(output / f"{name}.nfm.json").fit["quality"] == "draft"
    rows = json.loads((output / "summary.json").read_text())
    assert [row["status"] for row in rows] == [FAILED, FITTED, FITTED]

    (folder / "broken.bsdf").unlink()
    before = {path.name: path.stat().st_ino for path in output.glob("*.nfm.json")}
    assert main(command) == 0
    assert "0 fitted, 2 kept, 0 failed" in capsys.readouterr().out
    assert {path.name: path.stat().st_ino for path in output.glob("*.nfm.json")} == before


def test_folder_needs_a_folder_for_its_fits(folder, tmp_path, capsys):
    assert main(["fit", str(folder)]) == FAILED_STATUS
    assert "database: a folder; say with --output where" in capsys.readouterr().err
    taken = tmp_path / "taken"
    taken.write_text("")
    assert main(["fit", str(folder), "--out", str(taken)]) == FAILED_STATUS
    assert "taken: cannot be made a folder" in capsys.readouterr().err


def test_names_from_strangers_in_the_summary(folder, tmp_path, quick):
    path = folder / "a\n\x1b[2J.bsdf"
    (folder / "pearl.bsdf").rename(path)
    outcome = batch.fit_one(Job(path, tmp_path / "a\n\x1b[2J.nfm.json"), SETTINGS)
    text = batch.summary_text([outcome])
    assert text.startswith(r"a\n\x1b[2J.nfm.json  fitted  objective 1.00e-02")
    assert len(text.splitlines()) == 2
