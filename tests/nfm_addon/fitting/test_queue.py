# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits beside the interface: progress, drafts, cancelling, queueing."""

import os
import sys
import time
from pathlib import Path

import bpy
import pytest


def temporary_folders():
    return [path for path in Path(bpy.app.tempdir).iterdir() if path.name.startswith("nfm-")]


def has_draft(started):
    return lambda: started.item.material_slots and started.item.active_material is not None


def quality_of(started):
    return started.item.active_material.nfm.quality


def test_a_draft_then_the_fit_in_the_same_material(start, pump, queue):
    started = start()
    pump(has_draft(started))
    draft = started.item.active_material
    assert quality_of(started) == "draft"
    source = draft.nfm.parameters
    pump()
    assert started.item.active_material == draft
    assert quality_of(started) == "standard"
    assert draft.nfm.parameters != source
    assert draft.nfm.studio_psnr > 20
    (message,) = queue.messages
    assert message[0] == "INFO"
    assert message[1].startswith("copper is on Thing; error of native sampling ")
    assert temporary_folders() == []


def test_progress_rises_and_the_time_left_is_told(start, pump, addon):
    started = start()
    text_of = addon("fitting.status_bar").text_of
    assert text_of(started.job, 0) == "copper.binary: Waiting"
    seen = []
    # no further: on a busy machine the rest of the fit may be told at once
    pump(lambda: seen.append(started.job.progress) or started.job.progress > 0.05)
    assert seen == sorted(seen)
    assert started.job.seconds_left() > 0
    assert text_of(started.job, 2).endswith(" s left, 2 waiting")


def test_pumping_does_not_wait(start, queue):
    start()
    queue.pump()  # starts the process
    before = time.process_time(), time.monotonic()
    for _ in range(20):
        queue.pump()
    assert time.monotonic() - before[1] < 0.2


@pytest.mark.parametrize("when", ["before the draft", "after the draft"])
def test_cancelling_leaves_nothing(when, start, pump, queue, mesh_object, all_names):
    item = mesh_object(slots=2)
    item.active_material_index = 1
    before = all_names()
    started = start(item=item)
    if when == "after the draft":
        pump(lambda: item.active_material.nfm.parameters)
    else:
        pump(lambda: started.job.progress > 0)
    process = started.job.process._process
    queue.cancel(started.job)
    assert process.poll() is not None
    assert all_names() == before
    assert [slot.material.name for slot in item.material_slots] == ["old 0", "old 1"]
    assert queue.jobs == []
    assert temporary_folders() == []
    assert list(queue.messages) == [("INFO", "copper.binary: cancelled")]


def test_cancelling_takes_the_slot_away_that_the_draft_brought(start, pump, queue):
    started = start()
    pump(has_draft(started))
    queue.cancel(started.job)
    assert len(started.item.material_slots) == 0


def test_cancelling_leaves_a_slot_that_holds_something_else_by_now(start, pump, queue, blender):
    started = start()
    pump(has_draft(started))
    other = blender.data.materials.new("other")
    started.item.active_material = other
    queue.cancel(started.job)
    assert started.item.active_material == other
    assert "copper" not in blender.data.materials


def test_operator_cancels_the_first_or_all(start, blender, queue):
    assert not blender.ops.nfm.cancel_fit.poll()
    jobs = [start().job for _ in range(3)]
    blender.ops.nfm.cancel_fit()
    assert queue.jobs == jobs[1:]
    blender.ops.nfm.cancel_fit(all=True)
    assert queue.jobs == []


def test_two_imports_run_one_after_the_other(start, pump, queue):
    first, second = start(), start()
    pump(lambda: first.job not in queue.jobs)
    assert second.job.process is None
    assert second.job.step == "Waiting"
    pump()
    assert [quality_of(first), quality_of(second)] == ["standard", "standard"]
    assert first.item.active_material != second.item.active_material


def test_a_bad_file_is_told_and_the_next_one_runs(start, pump, queue, tmp_path, all_names):
    bad = tmp_path / "bad.binary"
    bad.write_bytes(bytes(7))
    first = start(bad)
    before = all_names()
    pump(lambda: first.job not in queue.jobs)
    assert all_names() == before
    ((level, text),) = queue.messages
    assert level == "ERROR"
    assert text.startswith("bad.binary: 7 bytes")


def test_a_fitter_that_dies_is_told_and_its_draft_goes(start, pump, queue, blender):
    started = start()
    pump(has_draft(started))
    started.job.process._process.kill()
    pump()
    ((level, text),) = queue.messages
    assert level == "ERROR"
    assert text.startswith("the fitter ended unexpectedly with status ")
    assert "copper" not in blender.data.materials


def test_last_words_of_a_fitter_that_fails(start, pump, queue, addon, monkeypatch):
    monkeypatch.setattr(addon("fitting.process"), "CODE", "raise SystemExit('out of luck')")
    start()
    pump()
    assert queue.messages[0][1].endswith("with status 1: out of luck")


def test_python_that_cannot_be_started_is_told(start, pump, queue, monkeypatch):
    monkeypatch.setattr(sys, "executable", os.devnull)
    start()
    pump()
    assert "Python could not be started" in queue.messages[0][1]
    assert temporary_folders() == []


def test_opening_a_file_ends_all(start, pump, queue, blender):
    started = start()
    start()
    pump(has_draft(started))
    process = started.job.process._process
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert queue.jobs == []
    assert process.poll() is not None
    assert temporary_folders() == []
    assert "copper" not in blender.data.materials


def test_the_fitter_takes_nothing_from_the_users_python(start, pump, queue, monkeypatch, tmp_path):
    (tmp_path / "numpy.py").write_text("raise SystemExit('not this one')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    started = start()
    pump(has_draft(started))
    assert quality_of(started) == "draft"


def test_results_wait_while_something_is_dragged(start, pump, queue, addon, monkeypatch):
    started = start()
    pump(lambda: started.job.progress > 0)
    monkeypatch.setattr(addon("fitting.queue"), "_is_dragging", lambda: True)
    started.job.process._reader.join(60)
    assert queue.pump() is True
    assert not started.item.material_slots
    monkeypatch.undo()
    pump()
    assert quality_of(started) == "standard"
