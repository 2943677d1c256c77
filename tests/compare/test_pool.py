# SPDX-License-Identifier: GPL-3.0-or-later
import multiprocessing
import os
import signal
import time
from functools import partial
from types import SimpleNamespace

import pytest

from compare import pool
from compare.models import Settings
from compare.pool import Task
from compare.store import Store
from fitter.errors import NfmError
from fitter.formats import merl

SETTINGS = Settings("log")


@pytest.fixture
def here(monkeypatch, tmp_path, make_result):
    """What a worker does, in this process and without fits."""
    steps = []

    class Steps:
        put = steps.append

    def graded(measurement, settings, scenes, on_step):
        assert (settings, scenes) == (SETTINGS, ())
        on_step()
        return make_result(measurement.source.file_name)

    monkeypatch.setattr(pool, "_worker", None)
    monkeypatch.setattr(pool, "grade", graded)
    store = Store(tmp_path)
    pool._prepare(SETTINGS, (), store, Steps)
    return store, steps


def test_worker_stores_what_it_grades(here, measured):
    store, steps = here
    task = Task(measured, merl.read(measured).source.sha256, "key")
    assert pool._grade(task) == task
    assert store.load("key").name == "copper.binary"
    assert len(steps) == 1


def test_file_that_was_changed_meanwhile(here, measured):
    store, _ = here
    with pytest.raises(NfmError, match=r"^copper\.binary: was changed"):
        pool._grade(Task(measured, "0" * 64, "key"))
    assert store.load("key") is None


def test_errors_come_back_from_the_processes(tmp_path):
    tasks = [Task(tmp_path / f"missing-{n}.binary", "0" * 64, "key") for n in range(2)]
    with pytest.raises(NfmError, match=r"^missing-\d\.binary: no such file"):
        list(pool.run(tasks, SETTINGS, [], Store(tmp_path), jobs=2))


def test_process_that_is_killed(measured, tmp_path):
    """As the kernel does when memory runs out: an error, not a wait without end."""
    # a scene that is never built: the process must not finish, or fail, before it is killed
    endless = SimpleNamespace(build=partial(time.sleep, 600))
    task = Task(measured, "0" * 64, "key")
    running = pool.run([task], SETTINGS, [endless], Store(tmp_path), jobs=1)
    next(running)
    (worker,) = multiprocessing.active_children()
    os.kill(worker.pid, signal.SIGKILL)
    with pytest.raises(NfmError, match="ended before its work was done"):
        list(running)
    assert multiprocessing.active_children() == []
