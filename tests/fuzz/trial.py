# SPDX-License-Identifier: GPL-3.0-or-later
"""One spoiled file through its reader, and what is wrong with how that went."""

import re
import signal
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitter.errors import NfmError, shown_name
from fitter.formats import parameter_file, readers

SECONDS = 5
LONGEST_MESSAGE = 600

# File names of strangers; every file system of ours takes these.
NAMES = ("gold{}", "two words{}", "a'b\"c{}", "line\nbreak{}", '"; }} closure{}', "\u202egold{}")

READERS = {"parameters": parameter_file.load}


class TooSlowError(Exception):
    """The reader took more than its seconds of CPU time."""


@dataclass(frozen=True)
class Verdict:
    """How a reader took a file.

    message : what it refused the file with, None if it took it
    memory : bytes that it had at most while it read
    faults : what is wrong with that; none for a reader that does its job
    """

    message: str | None
    faults: tuple[str, ...]
    memory: int


def read(path: Path, format_: str) -> Verdict:
    """Read a file that may be spoiled."""
    idle = forget_peak()
    before = sorted(path.parent.iterdir())
    faults = []
    message = None
    try:
        with _limited(SECONDS), warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            result = READERS.get(format_, readers.read)(path)
        faults += _faults_of_result(result)
    except NfmError as error:
        message = str(error)
        faults += _faults_of_message(message, path)
    except TooSlowError:
        faults.append(f"more than {SECONDS} s")
    except BaseException as error:  # what a reader may never raise, MemoryError included
        faults.append(f"{type(error).__name__}: {error}"[:LONGEST_MESSAGE])
    faults += [f"a warning: {warning.message}" for warning in warned]
    if sorted(path.parent.iterdir()) != before:
        faults.append("files were left behind")
    return Verdict(message, tuple(faults), peak() - idle)


def forget_peak() -> int:
    """Begin to watch the memory of this process anew (Linux); bytes that it has now."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak()


def peak() -> int:
    """The most memory, bytes, that this process has had since."""
    (line,) = re.findall(r"VmHWM:\s*(\d+) kB", Path("/proc/self/status").read_text())
    return int(line) * 1024


@contextmanager
def _limited(seconds: float):
    def stop(*_):
        raise TooSlowError

    # CPU time: other work on the machine does not count
    old = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)


def _faults_of_result(result: object) -> list[str]:
    if isinstance(result, parameter_file.FittedMaterial):
        model = result.model
        factors = (model.ndf, model.masking, model.fresnel, model.scale, model.diffuse)
        usable = all(np.isfinite(f).all() and (f >= 0).all() for f in factors)
    else:
        usable = np.isfinite(result.f_r).all() and (result.f_r >= 0).all() and result.f_r.any()
    return [] if usable else ["taken, with values that cannot be used"]


def _faults_of_message(message: str, path: Path) -> list[str]:
    faults = []
    if not message.startswith(f"{shown_name(path)}: "):
        faults.append("the message does not begin with the file")
    if not message.isprintable():
        faults.append("the message holds what does not print")
    if len(message) > LONGEST_MESSAGE:
        faults.append(f"a message of {len(message)} characters")
    if str(path.parent) in message:
        faults.append("the message shows folders")
    if ";" not in message.replace(shown_name(path), ""):
        faults.append("the message says nothing to do")
    return [f"{fault}: {message[:LONGEST_MESSAGE]}" for fault in faults]
