# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress of long work: a bar that redraws itself in a terminal, plain lines when piped."""

from __future__ import annotations

from types import TracebackType
from typing import TextIO

BAR_WIDTH = 30


class Progress:
    """Reports on one piece of work; a context manager, which ends the bar's line.

    In a pipe it writes one line for each change of `step` and none for the fraction.
    """

    def __init__(self, stream: TextIO, label: str) -> None:
        self._stream = stream
        self._label = label
        self._is_terminal = stream.isatty()
        self._step: str | None = None
        self._width = 0

    def __enter__(self) -> Progress:
        """Start."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave the cursor on a fresh line."""
        if self._is_terminal and self._width:
            self._stream.write("\n")
            self._stream.flush()

    def update(self, fraction: float, step: str) -> None:
        """Show the share that is done (0..1) and the name of the step."""
        if self._is_terminal:
            filled = round(min(max(fraction, 0), 1) * BAR_WIDTH)
            bar = "#" * filled + "." * (BAR_WIDTH - filled)
            line = f"{self._label} [{bar}] {fraction:4.0%} {step}"
            self._stream.write("\r" + line.ljust(self._width))
            self._width = len(line)
        elif step != self._step:
            self._stream.write(f"{self._label}: {step}\n")
        self._step = step
        self._stream.flush()
