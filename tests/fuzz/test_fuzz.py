# SPDX-License-Identifier: GPL-3.0-or-later
"""Spoiled files leave every reader whole, and the fuzzer would notice if not."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from fitter.errors import MeasurementError
from runner.environment import CHECKOUT
from tests.fuzz import __main__ as fuzz
from tests.fuzz import mutations, trial

pytest.importorskip("OpenEXR")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(CHECKOUT)}
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="memory is watched through /proc")


@LINUX
def test_readers_stand_spoiled_files(tmp_path):
    command = [sys.executable, "-P", "-m", "tests.fuzz", "--count", "120", "--keep", tmp_path]
    run = subprocess.run(
        command,
        cwd=CHECKOUT,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    )
    assert (run.returncode, run.stderr) == (0, ""), run.stdout
    assert [line.split()[0] for line in run.stdout.splitlines()[1:]] == list(fuzz.SHARES)
    assert list(tmp_path.iterdir()) == []


def test_the_same_seed_gives_the_same_files():
    contents = [bytes(range(256)) * 8, b'{"a": [1, {"b": 2}]}']
    for name, number in (("rgl", 0), ("parameters", 1)):
        first, second, other = (fuzz.spoiled(name, number, contents, seed) for seed in (0, 0, 1))
        assert first == second != other


@pytest.mark.parametrize("mutation", sorted({*mutations.BINARY}, key=lambda m: m.__name__))
@pytest.mark.parametrize("size", [0, 1, 100, 5000])
def test_mutations_take_files_of_any_size(mutation, size):
    rng = np.random.default_rng(size)
    assert all(isinstance(mutation(bytes(size), rng), bytes) for _ in range(20))


def leaves_files(path):
    path.with_name("left behind").touch()
    raise MeasurementError(f"{path.name}: spoiled; download it again")


def warns(path):
    warnings.warn("careful", stacklevel=1)
    raise MeasurementError(f"{path.name}: spoiled; download it again")


def raises(message):
    def read(path):
        raise MeasurementError(message)

    return read


@LINUX
@pytest.mark.parametrize(
    ("reader", "fault"),
    [
        (lambda path: {}["key"], "KeyError"),
        (raises("other.bin: spoiled; download it again"), "does not begin with the file"),
        (raises("gold.bin: spoiled"), "nothing to do"),
        (raises("gold.bin: two\nlines; download it again"), "does not print"),
        (raises("gold.bin: " + "long " * 200 + "; download it again"), "characters"),
        (leaves_files, "left behind"),
        (warns, "a warning: careful"),
    ],
)
def test_faults_of_a_reader_are_found(monkeypatch, tmp_path, reader, fault):
    monkeypatch.setitem(trial.READERS, "bad", reader)
    path = tmp_path / "gold.bin"
    path.touch()
    (found,) = trial.read(path, "bad").faults
    assert fault in found


@LINUX
def test_a_reader_without_end_is_stopped(monkeypatch, tmp_path):
    def endless(_):
        while True:
            pass

    monkeypatch.setattr(trial, "SECONDS", 0.1)
    monkeypatch.setitem(trial.READERS, "bad", endless)
    assert trial.read(tmp_path / "gold.bin", "bad").faults == ("more than 0.1 s",)


HUNGRY = """
import sys
from pathlib import Path
import numpy as np
from fitter.errors import MeasurementError
from tests.fuzz import trial

def hungry(path):
    np.ones(50_000_000 // 8)
    raise MeasurementError(f"{path.name}: spoiled; download it again")

trial.READERS["bad"] = hungry
verdict = trial.read(Path(sys.argv[1]), "bad")
assert verdict.faults == (), verdict
print(verdict.memory)
"""


@LINUX
def test_memory_of_a_reader_is_seen(tmp_path):
    """In a process like the fuzzer's; one that has had more keeps what it had."""
    command = [sys.executable, "-P", "-c", HUNGRY, tmp_path / "gold.bin"]
    run = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    assert 45_000_000 < int(run.stdout) < 80_000_000


def test_a_crash_is_a_finding_and_the_rest_goes_on():
    code = (
        "import json, os, sys\n"
        "for number in json.loads(sys.argv[1])['numbers']:\n"
        "    if number == 1: os.kill(os.getpid(), 9)\n"
        "    print(json.dumps({'message': None, 'faults': []}), flush=True)"
    )
    worker = (sys.executable, "-c", code)
    results = list(fuzz.run("rgl", [0, 1, 2], [Path("a.bsdf")], 0, worker))
    assert [number for number, _ in results] == [0, 1, 2]
    assert [result["faults"] for _, result in results] == [
        [],
        ["the process ended with status -9"],
        [],
    ]
