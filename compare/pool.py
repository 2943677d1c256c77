# SPDX-License-Identifier: GPL-3.0-or-later
"""Grade measurements in several processes, each with one thread."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.queues import SimpleQueue
from pathlib import Path

from fitter import readers
from fitter.errors import NfmError, shown_name
from fitter.sphere import LitScene

from .grading import grade
from .models import Settings
from .scenes import SceneSource
from .store import Store

# How often progress is asked for, seconds.
PATIENCE = 0.2


@dataclass(frozen=True)
class Task:
    """A file to grade, its sha256 when it was first read, and where its result goes."""

    path: Path
    sha256: str
    key: str


@dataclass(frozen=True)
class _Worker:
    """What a process keeps between tasks."""

    settings: Settings
    scenes: tuple[LitScene, ...]
    store: Store
    steps: SimpleQueue


_worker: _Worker | None = None


def run(
    tasks: Sequence[Task],
    settings: Settings,
    scenes: Sequence[SceneSource],
    store: Store,
    jobs: int,
) -> Iterator[tuple[int, Task | None]]:
    """Grade and store; yield the models fitted so far and, when it is one, the finished task.

    Raises
    ------
    NfmError
        From the process that met it; the others are ended. What was stored stays.
    """
    # a process of its own even for one job: numpy reads the number of threads when it starts
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    context = multiprocessing.get_context("spawn")
    steps = context.SimpleQueue()
    arguments = (settings, tuple(scenes), store, steps)
    with context.Pool(min(jobs, len(tasks)), _initialize, arguments) as pool:
        workers = _children()
        finished = pool.imap_unordered(_grade, tasks)
        n_steps = n_finished = 0
        while n_finished < len(tasks):
            task = None
            try:
                task = finished.next(timeout=PATIENCE)
                n_finished += 1
            except multiprocessing.TimeoutError:
                # the pool would replace it, but nobody would do its task
                if _children() != workers:
                    raise NfmError(
                        "a process ended before its work was done; free some memory or use "
                        "--jobs 1, and start again: what is finished is kept"
                    ) from None
            while not steps.empty():
                steps.get()
                n_steps += 1
            yield n_steps, task


def _children() -> set[int | None]:
    return {process.pid for process in multiprocessing.active_children()}


def _initialize(
    settings: Settings, scenes: tuple[SceneSource, ...], store: Store, steps: SimpleQueue
) -> None:
    # Ctrl-C reaches every process of the terminal; the parent ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    global _worker
    _worker = _Worker(settings, tuple(scene.build() for scene in scenes), store, steps)


def _grade(task: Task) -> Task:
    measurement = readers.read_isotropic(task.path)
    if measurement.source.sha256 != task.sha256:
        raise NfmError(f"{shown_name(task.path)}: was changed while it was compared; start again")
    result = grade(
        measurement, _worker.settings, _worker.scenes, on_step=lambda: _worker.steps.put(None)
    )
    _worker.store.save(task.key, result)
    return task
