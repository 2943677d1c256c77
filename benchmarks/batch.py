# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory of ./nfm fit FOLDER: whether many files need more than two.

Every file is a whole MERL file, a link to the same synthetic sample (so nothing is saved by their
being alike: each is read and fitted). What is printed is the largest sum over the process and its
workers of what they hold of the machine's memory, seen every tenth of a second.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fitter import synthetic
from fitter.errors import NfmError

SAMPLE = "copper-paint"

# Of the largest run to the smallest; what Python keeps for itself differs from run to run.
LARGEST_RATIO = 1.1

INTERVAL = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench batch."""
    parser.add_argument("--files", default="2,12", metavar="N,N", help="default: 2,12")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes; default: 2")
    parser.add_argument("--quality", default="draft", help="default: draft")


def run(arguments: argparse.Namespace) -> int:
    """Fit folders of several sizes and compare; returns 1 if memory grows."""
    peaks = []
    print(f"{'files':>6} {'CPU s':>8} {'peak MB':>8}")
    for count in map(int, arguments.files.split(",")):
        with tempfile.TemporaryDirectory(prefix="nfm-bench-") as scratch:
            folder = Path(scratch, "database")
            folder.mkdir()
            first = folder / "0.binary"
            synthetic.write_sample(first, SAMPLE)
            for number in range(1, count):
                os.link(first, folder / f"{number}.binary")
            peak, seconds = _measured(folder, Path(scratch, "fits"), arguments)
        peaks.append(peak)
        print(f"{count:6} {seconds:8.1f} {peak / 1e6:8.0f}", flush=True)
    ratio = max(peaks) / peaks[0]
    print(f"{'met   ' if ratio <= LARGEST_RATIO else 'MISSED'} {ratio:.2f} times the first")
    return int(ratio > LARGEST_RATIO)


def _measured(folder: Path, output: Path, arguments: argparse.Namespace) -> tuple[int, float]:
    """Largest memory in bytes, and CPU seconds."""
    before = os.times()
    command = [sys.executable, "-P", "-m", "fitter", "fit", folder, "--output", output]
    options = ["--jobs", arguments.jobs, "--quality", arguments.quality]
    process = subprocess.Popen(
        [*map(str, command + options)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])},
    )
    peak = 0
    while process.poll() is None:
        peak = max(peak, _memory(process.pid))
        time.sleep(INTERVAL)
    errors = process.stderr.read().decode()
    if process.returncode:
        raise NfmError(f"fitting the folder failed: {errors.strip()[-300:]}")
    after = os.times()
    return peak, sum(after[2:4]) - sum(before[2:4])


def _memory(pid: int) -> int:
    """Resident bytes of a process and of all that it started, as Linux counts them."""
    children: dict[int, list[int]] = {}
    resident = {}
    for path in Path("/proc").glob("[0-9]*"):
        try:
            # the name, in brackets, may hold spaces
            fields = (path / "stat").read_text().rpartition(")")[2].split()
            resident[int(path.name)] = int(fields[21]) * os.sysconf("SC_PAGE_SIZE")
        except OSError:
            continue  # it has ended
        children.setdefault(int(fields[1]), []).append(int(path.name))
    total, waiting = 0, [pid]
    while waiting:
        one = waiting.pop()
        total += resident.get(one, 0)
        waiting += children.get(one, [])
    return total
