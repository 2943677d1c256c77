# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm fuzz: spoiled files of every format through the readers.

Readers run in processes of their own, so that a crash is a finding and not the end. The same seed
gives the same files. A file that a reader did not stand is kept, with what was wrong.
"""

import argparse
import json
import re
import resource
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from . import corpus, mutations, trial

# Shares of the inputs: a MERL file has 35 MB, whatever it says.
SHARES = {"merl": 0.03, "utia-bin": 0.17, "utia-exr": 0.3, "rgl": 0.2, "parameters": 0.3}
INPUTS_PER_PROCESS = 250
SILENCE = 120  # seconds after which a reader that does not come back is stuck
WORKER = (sys.executable, "-P", "-m", "tests.fuzz", "--worker")
MOST_MEMORY = 8 << 30
SLACK = 4 << 20  # bytes, what an allocator may keep


def main(arguments: list[str]) -> int:
    """Print a table; 1 if any reader failed."""
    parser = argparse.ArgumentParser(prog="nfm fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=10_000, help="files in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--format", choices=SHARES, action="append", help="only this one")
    parser.add_argument("--keep", type=Path, default=Path("nfm-fuzz"), metavar="FOLDER")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.worker:
        return work(**json.loads(options.worker))
    formats = options.format or list(SHARES)
    whole = sum(SHARES[name] for name in formats)
    with tempfile.TemporaryDirectory(prefix="nfm-fuzz-") as folder:
        files = corpus.write(Path(folder))
        print(f"{'format':<12}{'files':>8}{'taken':>8}{'refused':>9}{'messages':>10}{'failed':>8}")
        failed = 0
        for name in formats:
            count = round(options.count * SHARES[name] / whole)
            failed += _report(name, count, files[name], options)
    return 1 if failed else 0


def _report(name: str, count: int, honest: list[Path], options: argparse.Namespace) -> int:
    tally: Counter[str] = Counter()
    messages = set()
    for start in range(0, count, INPUTS_PER_PROCESS):
        numbers = list(range(start, min(start + INPUTS_PER_PROCESS, count)))
        for number, result in run(name, numbers, honest, options.seed):
            tally[
                "failed" if result["faults"] else "refused" if result["message"] else "taken"
            ] += 1
            messages.add(_kind_of_message(result["message"]))
            if result["faults"]:
                _keep(options.keep, name, number, honest, options.seed, result["faults"])
    print(
        f"{name:<12}{count:>8}{tally['taken']:>8}{tally['refused']:>9}"
        f"{len(messages - {''}):>10}{tally['failed']:>8}",
        flush=True,
    )
    return tally["failed"]


def run(
    name: str,
    numbers: list[int],
    honest: list[Path],
    seed: int,
    worker: tuple[str, ...] = WORKER,
) -> Iterator[tuple[int, dict]]:
    """Number and result of each input; a process that dies is followed by another."""
    while numbers:
        request = {"name": name, "numbers": numbers, "honest": [*map(str, honest)], "seed": seed}
        process = subprocess.Popen(
            [*worker, json.dumps(request)], stdout=subprocess.PIPE, text=True
        )
        done = 0
        for line in process.stdout:
            yield numbers[done], json.loads(line)
            done += 1
        status = process.wait()
        if done < len(numbers):
            fault = f"the process ended with status {status}"
            yield numbers[done], {"message": None, "faults": [fault]}
            done += 1
        numbers = numbers[done:]


def work(name: str, numbers: list[int], honest: list[str], seed: int) -> int:
    """What a process does: read, and print a line of JSON for each input."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    contents = [Path(path).read_bytes() for path in honest]
    trial.read(Path(honest[0]), name)  # what is loaded and made once does not count
    verdicts = [trial.read(Path(path), name) for path in honest]
    assert not any(verdict.faults for verdict in verdicts), verdicts
    limit = 2 * max(verdict.memory for verdict in verdicts) + SLACK
    for number in numbers:
        content, names = spoiled(name, number, contents, seed)
        with tempfile.TemporaryDirectory(prefix="nfm-fuzz-") as folder:
            path = Path(folder, file_name(number, honest))
            path.write_bytes(content)
            signal.alarm(SILENCE)  # its default action ends the process
            verdict = trial.read(path, name)
        faults = [f"{fault} (after {', '.join(names)})" for fault in verdict.faults]
        if verdict.memory > limit:
            faults.append(f"{verdict.memory / limit:.1f} x the memory allowed")
        print(json.dumps({"message": verdict.message, "faults": faults}), flush=True)
    return 0


def spoiled(name: str, number: int, contents: list[bytes], seed: int) -> tuple[bytes, list[str]]:
    """Input `number` of a format and the mutations that made it."""
    rng = np.random.default_rng([seed, *name.encode(), number])
    content = contents[number % len(contents)]
    return mutations.mutated(content, name == "parameters", rng)


def file_name(number: int, honest: list[str]) -> str:
    """Name of an input, with the suffixes of the file that it was made of."""
    path = Path(honest[number % len(honest)])
    return trial.NAMES[number % len(trial.NAMES)].format("".join(path.suffixes))


def _keep(
    folder: Path, name: str, number: int, honest: list[Path], seed: int, faults: list[str]
) -> None:
    content, _ = spoiled(name, number, [path.read_bytes() for path in honest], seed)
    folder.mkdir(exist_ok=True)
    kept = folder / f"{name}-{seed}-{number}{''.join(honest[number % len(honest)].suffixes)}"
    kept.write_bytes(content)
    print(f"{kept}: {'; '.join(faults)}", flush=True)


def _kind_of_message(message: str | None) -> str:
    """A message without the file's name and numbers, to count kinds."""
    return re.sub(r"[\d.,]+", "0", (message or "").partition(": ")[2])[:40]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
