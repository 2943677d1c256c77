# SPDX-License-Identifier: GPL-3.0-or-later
"""Background fits, pumped by the tests: no timers run in the background."""

import time
from types import SimpleNamespace

import pytest

from fitter import synthetic

# In the fitting process, before its main: fits that take a moment.
SHORT_FITS = """
import sys
sys.path.insert(0, sys.argv[1])
sys.path.append(sys.argv[2])
from fitter.jobs import job
from fitter.fitting import quality
for name in ("draft", "standard"):
    quality.QUALITIES[name] = quality.Quality(1, 1, 0, 1, 0, 1, 0, 0, 45, 90, 0, 90)
job.main(sys.argv[3])
"""


@pytest.fixture(scope="session")
def sample(tmp_path_factory):
    """A measured file."""
    path = tmp_path_factory.mktemp("fitting") / "copper.binary"
    synthetic.write_sample(path, "brushed-copper")
    return path


@pytest.fixture
def queue(addon, monkeypatch):
    """The queue of the add-on, empty, with short fits."""
    monkeypatch.setattr(addon("fitting.process"), "CODE", SHORT_FITS)
    found = addon("fitting.queue").queue
    assert not found.jobs
    yield found
    found.forget_all()


@pytest.fixture
def pump(queue):
    """Pump until a condition holds."""

    def run(done=lambda: not queue.jobs, seconds=60):
        end = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < end
            queue.pump()
            time.sleep(0.02)

    return run


@pytest.fixture
def start(addon, queue, sample, mesh_object):
    """Ask for an import onto the active object."""
    landing, module = addon("fitting.landing"), addon("fitting.queue")

    def run(path=sample, item=None, **options):
        item = item or mesh_object()
        place = landing.NewMaterial(str(path), "NATIVE", [item.session_uid], **options)
        job = module.Job(str(path), "standard", place)
        queue.add(job)
        return SimpleNamespace(job=job, item=item, place=place)

    return run
