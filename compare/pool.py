# SPDX-License-Identifier: GPL-3.0-or-later
"""Grade measurements in several processes, each with one thread."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.queues import SimpleQueue
from pathlib import Path

from fitter.errors import NfmError, shown_name
from fitter.formats import readers
from fitter.jobs import workers
from fitter.pictures.sphere import LitScene

from .grading import grade
from .models import Settings
from .scenes import SceneSource
from .store import Store


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
    steps = workers.CONTEXT.SimpleQueue()
    arguments = (settings, tuple(scenes), store, steps)
    n_steps = 0
    for task in workers.run(_grade, tasks, jobs, _prepare, arguments):
        while not steps.empty():
            steps.get()
            n_steps += 1
        yield n_steps, task


def _prepare(
    settings: Settings, scenes: tuple[SceneSource, ...], store: Store, steps: SimpleQueue
) -> None:
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
