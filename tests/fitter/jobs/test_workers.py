# SPDX-License-Identifier: GPL-3.0-or-later
"""Processes start slowly, so these tests use few of them; tests/compare/test_pool.py has more."""

import math
import multiprocessing
import os
import signal

import pytest

from fitter.errors import NfmError
from fitter.jobs import workers


def results_of(running):
    return [result for result in running if result is not None]


def test_everything_is_done_once_in_processes_of_one_thread():
    found = results_of(workers.run(math.factorial, range(2, 9), jobs=2))
    assert sorted(found) == [math.factorial(n) for n in range(2, 9)]
    assert multiprocessing.active_children() == []


def test_processes_are_prepared_with_one_thread():
    running = workers.run(os.path.expandvars, ["$OPENBLAS_NUM_THREADS"], 1)
    assert results_of(running) == ["1"]


def test_what_prepares_a_process_runs_before_its_work(tmp_path):
    (tmp_path / "marker").write_text("")
    running = workers.run(os.path.exists, ["marker"], 1, os.chdir, (str(tmp_path),))
    assert results_of(running) == [True]


def test_errors_come_back(tmp_path):
    with pytest.raises(FileNotFoundError):
        results_of(workers.run(os.stat, [str(tmp_path / "none")], jobs=1))


def test_process_that_is_killed():
    with pytest.raises(NfmError, match="ended before its work was done"):
        results_of(workers.run(_kill_self, [signal.SIGKILL], jobs=1))


def _kill_self(number):
    os.kill(os.getpid(), number)
