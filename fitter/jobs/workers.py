# SPDX-License-Identifier: GPL-3.0-or-later
"""The same work on many things, in several processes of one thread each."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ..errors import NfmError

# How often a caller that waits gets a word, seconds.
PATIENCE = 0.2

CONTEXT = multiprocessing.get_context("spawn")


def run(
    work: Callable[[Any], Any],
    tasks: Sequence[Any],
    jobs: int,
    prepare: Callable[..., None] | None = None,
    arguments: tuple = (),
) -> Iterator[Any | None]:
    """Yield what work(task) returns as it comes, and None every PATIENCE seconds in between.

    prepare : called with `arguments` at the beginning of every process

    Raises
    ------
    NfmError
        From the process that met it, or a process was ended from outside; the others are ended.
    """
    # a process of its own even for one job: numpy reads the number of threads when it starts
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with CONTEXT.Pool(min(jobs, len(tasks)), _begin, (prepare, arguments)) as pool:
        workers = _children()
        finished = pool.imap_unordered(work, tasks)
        n_finished = 0
        while n_finished < len(tasks):
            try:
                result = finished.next(timeout=PATIENCE)
            except multiprocessing.TimeoutError:
                # the pool would replace it, but nobody would do its task
                if _children() != workers:
                    raise NfmError(
                        "a process ended before its work was done; free some memory or use "
                        "--jobs 1, and start again: what is finished is kept"
                    ) from None
                yield None
            else:
                n_finished += 1
                yield result


def _children() -> set[int | None]:
    return {process.pid for process in multiprocessing.active_children()}


def _begin(prepare: Callable[..., None] | None, arguments: tuple) -> None:
    # Ctrl-C reaches every process of the terminal; the parent ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if prepare:
        prepare(*arguments)
