# SPDX-License-Identifier: GPL-3.0-or-later
"""The fitter in a process of its own, started by Blender and read without waiting.

Python's threads would share the interpreter with the interface, which would stutter; and a process
can be ended at any moment without a trace.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from dataclasses import asdict
from pathlib import Path
from queue import Empty, SimpleQueue

import bpy
import numpy as np

from ...fitter.jobs.job import FINAL, KEPT, Event, Request

EXTENSION = Path(__file__).resolve().parents[2]

# Isolated from the user's variables and folders; the extension and Blender's numpy are named.
CODE = """
import sys
sys.path.insert(0, sys.argv[1])
sys.path.append(sys.argv[2])
from fitter.jobs import job
job.main(sys.argv[3])
"""


class FitProcess:
    """A running fit. Its folder exists until `close`, which also ends it.

    Raises
    ------
    OSError
        The process cannot be started.
    """

    def __init__(
        self,
        path: str,
        quality: str,
        *,
        draft: bool,
        encoding: str | None = None,
        output: str | None = None,
        shading: bool = False,
    ) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="nfm-", dir=bpy.app.tempdir))
        request = Request(path, quality, draft, str(self.folder), encoding, output, shading)
        packages = Path(np.__file__).resolve().parents[1]
        # bytecode halves the time of the imports; where Blender writes none, nor does this
        flags = ["-I", *(["-B"] if sys.dont_write_bytecode else [])]
        command = [sys.executable, *flags, "-c", CODE, EXTENSION, packages]
        self._errors = (self.folder / "errors.txt").open("w+b")
        try:
            self._process = subprocess.Popen(
                [*map(str, command), json.dumps(asdict(request))],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
                encoding="utf-8",
            )
        except OSError:
            self._remove_folder()
            raise
        self._events: SimpleQueue[Event] = SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def events(self) -> list[Event]:
        """What has happened since the last call; the last event is "final", "kept" or "error"."""
        events = []
        while True:
            try:
                events.append(self._events.get_nowait())
            except Empty:
                return events

    def close(self) -> None:
        """End the process if it still runs, and remove its folder."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        self._process.stdout.close()
        self._remove_folder()

    def _read(self) -> None:
        event = None
        for line in self._process.stdout:
            event = Event(**json.loads(line))
            self._events.put(event)
        if event is None or event.kind not in (FINAL, KEPT, "error"):
            status = self._process.wait()
            message = f"the fitter ended unexpectedly with status {status}{self._last_words()}"
            self._events.put(Event("error", message, 1.0))

    def _last_words(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode("utf-8", "replace").strip().splitlines()
        return f": {lines[-1][:200]}" if lines else "; is there memory left?"

    def _remove_folder(self) -> None:
        self._errors.close()
        shutil.rmtree(self.folder, ignore_errors=True)
