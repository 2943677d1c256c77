# SPDX-License-Identifier: GPL-3.0-or-later
"""A real scheduler and real workers on this machine, where Dask is installed."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest

from fitter.errors import NfmError
from fitter.formats import parameter_file
from fitter.jobs import batch, cluster
from fitter.jobs.batch import FAILED, FITTED, KEPT, Settings
from tests import rgl_files

FILES = 4


def test_without_dask(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(NfmError, match="--dask needs the package distributed"):
        next(cluster.run([], Settings(), "tcp://127.0.0.1:1"))


def test_nobody_answers(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(NfmError, match=r"--dask tcp://127\.0\.0\.1:1: no Dask scheduler answers"):
        next(cluster.run([], Settings(), "tcp://127.0.0.1:1"))


@contextlib.contextmanager
def process(module, *arguments, folder):
    """A process of Dask's that does not see this checkout; it must not outlive the test."""
    command = [sys.executable, "-P", "-m", module, *arguments]
    variables = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    running = subprocess.Popen(
        command, cwd=folder, env=variables, stderr=subprocess.PIPE, text=True
    )
    try:
        yield running
    finally:
        running.kill()
        running.wait()
        running.stderr.close()


def address_of(scheduler):
    for line in scheduler.stderr:
        if "tcp://" in line and "Scheduler at" in line:
            return line.split()[-1]
    raise AssertionError("the scheduler did not start")


@pytest.fixture
def jobs(tmp_path):
    database, fits = tmp_path / "database", tmp_path / "fits"
    database.mkdir()
    fits.mkdir()
    content = rgl_files.tensor_bytes(rgl_files.fields_of(rgl_files.glossy, n=6, n_theta=3))
    for number in range(FILES):
        (database / f"m{number}.bsdf").write_bytes(content + bytes(number))
    (database / "broken.bsdf").write_bytes(content[:100])
    return batch.jobs_of(database, fits)


@pytest.mark.one_version
def test_worker_that_is_killed_half_way(jobs, tmp_path):
    """Nothing is lost, nothing fitted twice, and a failure of one file is no failure of others."""
    pytest.importorskip("distributed")
    worker = ("distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard")
    with process(
        "distributed.cli.dask_scheduler",
        *("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--dashboard-address", ":0"),
        folder=tmp_path,
    ) as scheduler:
        address = address_of(scheduler)
        with (
            process(*worker, address, folder=tmp_path) as first,
            process(*worker, address, folder=tmp_path),
        ):
            outcomes, written = [], {}
            for outcome in cluster.run(jobs, Settings(quality="draft"), address):
                outcomes.append(outcome)
                for job in jobs:
                    if job.output.is_file():
                        written.setdefault(job.output.name, job.output.stat().st_ino)
                if outcome.status == FITTED and first.poll() is None:
                    first.send_signal(signal.SIGKILL)
                    first.wait()
            again = list(cluster.run(jobs, Settings(quality="draft"), address))
    assert sorted(outcome.job.path.name for outcome in outcomes) == [job.path.name for job in jobs]
    statuses = [outcome.status for outcome in outcomes]
    assert statuses.count(FAILED) == 1
    assert statuses.count(FITTED) + statuses.count(KEPT) == FILES
    for job in jobs[1:]:
        assert parameter_file.load(job.output).fit["quality"] == "draft"
        # a second fit would have put another file in the place of the first
        assert job.output.stat().st_ino == written.get(job.output.name, job.output.stat().st_ino)
    assert sorted(outcome.status for outcome in again) == [FAILED] + FILES * [KEPT]
