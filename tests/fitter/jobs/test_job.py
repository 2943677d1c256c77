# SPDX-License-Identifier: GPL-3.0-or-later
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitter import synthetic
from fitter.fitting.quality import QUALITIES, Quality
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs import job
from fitter.shading import shading
from runner.environment import CHECKOUT
from tests.models import MODELS

SHORT = Quality(1, 1, 0, 1, 0, 1, 0, 0, 45, 90, 1, 90)


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    path = tmp_path_factory.mktemp("job") / "copper.binary"
    synthetic.write_sample(path, "brushed-copper")
    return path


def run(path, folder, **options):
    """Events of a job whose fits are short."""
    request = {"quality": "standard", "draft": True, "folder": str(folder)} | options
    events = []
    with pytest.MonkeyPatch.context() as patch:
        for name in ("draft", "standard"):
            patch.setitem(QUALITIES, name, SHORT)
        job.run(job.Request(path=str(path), **request), events.append)
    return events


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def events(sample, folder):
    """Of a draft and the fit after it, each with its base lobes."""
    return run(sample, folder, shading=True)


def test_a_draft_comes_first_and_progress_never_falls(events):
    assert [event.kind for event in events if event.kind != "step"] == ["draft", "final"]
    progress = [event.progress for event in events]
    assert progress == sorted(progress)
    assert (progress[0], progress[-1]) == (0.0, 1.0)
    steps = list(dict.fromkeys(event.text for event in events if event.kind == "step"))
    fit = ["Trying start 1", "Refining", "Polishing", "Grading"]
    assert steps == ["Reading", "Draft", "Base lobes", *fit]


def test_base_lobes_come_with_every_result_that_is_asked_for(events):
    results = [event for event in events if event.kind != "step"]
    assert [event.kind for event in results] == ["draft", "final"]
    assert sum(event.text == "Base lobes" for event in events) == 2
    for event in results:
        found = shading.load(job.shading_path(Path(event.text)))
        expected = shading.shade(parameter_file.load(event.text).model)
        assert found.error == expected.error
        np.testing.assert_array_equal(found.base.weights, expected.base.weights)


def test_a_parameter_file_needs_no_fit(tmp_path):
    path = tmp_path / "paint.nfm.json"
    parameter_file.save(path, FittedMaterial("paint", MODELS["paint"]))
    events = run(path, tmp_path, shading=True)
    assert [event.text for event in events if event.kind == "step"] == ["Reading", "Base lobes"]
    assert events[-1].kind == "final"
    assert parameter_file.load(events[-1].text).name == "paint"
    assert job.shading_path(Path(events[-1].text)).exists()


def test_results_are_parameter_files_slices_and_an_icon(events, folder):
    draft, final = (parameter_file.load(e.text) for e in events if e.kind != "step")
    assert draft.fit["quality"] == "draft"
    assert "studio_psnr" not in draft.fit
    assert final.fit["quality"] == "standard"
    assert final.fit["studio_psnr"] > 20
    assert np.load(folder / job.SLICES_FILE).shape == (4, 359, 3)
    assert np.load(folder / job.ICON_FILE).shape == (128, 128, 4)


@pytest.mark.parametrize("options", [{"draft": False}, {"quality": "draft"}])
def test_without_a_draft(options, sample, tmp_path):
    events = run(sample, tmp_path, **options)
    kinds = [event.kind for event in events]
    assert kinds.count("final") == 1
    assert "draft" not in kinds
    assert not any(event.text == "Base lobes" for event in events)


def test_a_bad_file_is_the_last_event(tmp_path):
    path = tmp_path / "bad.binary"
    path.write_bytes(bytes(7))
    *_, last = run(path, tmp_path)
    assert last.kind == "error"
    assert "bad.binary: 7 bytes" in last.text


def test_as_a_process_it_writes_lines_of_json(tmp_path):
    request = {"path": str(tmp_path / "no.binary"), "quality": "draft", "draft": False}
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from fitter.jobs import job; job.main(sys.argv[2])"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, CHECKOUT, json.dumps(request | {"folder": str(tmp_path)})],
        capture_output=True,
        text=True,
    )
    assert answer.returncode == 0, answer.stderr
    first, last = map(json.loads, answer.stdout.splitlines())
    assert first == {"kind": "step", "text": "Reading", "progress": 0.0}
    assert (last["kind"], last["text"]) == ("error", "no.binary: no such file; check the path")


def test_a_stage_without_a_name_is_told_as_it_is():
    events = []
    tell = job._teller(events.append, "", 0.0, 1.0)
    for stage in ("refine", "sweep 2", "new stage"):
        tell(SimpleNamespace(stage=stage, progress=0.5))
    assert [event.text for event in events] == ["Refining", "Trying start 2", "new stage"]
