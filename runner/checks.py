"""./nfm test: ruff, then pytest once per Blender version, both versions at the same time.

Tests with the mark one_version take long and are about numpy alone: whole fits. The second lane
leaves them to the first. A lane that runs alone, as ./nfm --blender 4.5 test does, runs them all.

With --coverage, one version alone, and a table of the share of lines that the tests reach.

The lanes share nothing: each has its interpreter, its environment and its pytest cache. What the
second one prints is shown when the first has ended, so that the two do not mix.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from typing import BinaryIO

from .environment import CHECKOUT, folder
from .messages import say

# Blender version of each Python version, as the pins in pyproject.toml have it.
BLENDER = {"3.13": "5.2", "3.11": "4.5"}

NO_TESTS_COLLECTED = 5  # pytest's exit status
COVERAGE = "--coverage"
LEFT_TO_THE_FIRST = ["-m", "not one_version"]


def main(arguments: list[str]) -> int:
    """Run everything, also after a failure; return the first exit status that is not 0.

    Arguments are pytest's. Who gives some is after certain tests, so ruff is left out.
    """
    here = "{}.{}".format(*sys.version_info[:2])
    alone = bool(os.environ.get("NFM_BLENDER"))
    # A test that starts ./nfm stays in its lane.
    os.environ["NFM_BLENDER"] = BLENDER[here]

    if COVERAGE in arguments:
        return _with_coverage([argument for argument in arguments if argument != COVERAGE])
    statuses = [] if arguments else _ruff()
    with tempfile.TemporaryFile() as output:
        (other,) = BLENDER.keys() - {here}
        second = None if alone else _start_second_lane(other, arguments, output)
        try:
            say(f"pytest on Blender {BLENDER[here]}")
            pytest = [sys.executable, "-P", "-m", "pytest"]
            statuses.append(_in_checkout([*pytest, *_cache(here), *arguments]))
            if second:
                statuses.append(_finish(second, other, arguments, output))
        finally:
            if second and second.poll() is None:  # after Ctrl-C in the first
                second.terminate()
    return next((status for status in statuses if status != 0), 0)


def _with_coverage(arguments: list[str]) -> int:
    """Run pytest once and print how many lines it reached; pytest's exit status.

    Processes that tests start are not followed.
    """
    # Python 3.12 and later count lines at little cost
    os.environ.setdefault("COVERAGE_CORE", "sysmon" if sys.version_info >= (3, 12) else "ctrace")
    coverage = [sys.executable, "-P", "-m", "coverage"]
    with tempfile.TemporaryDirectory(prefix="nfm-coverage-") as scratch:
        os.environ["COVERAGE_FILE"] = f"{scratch}/coverage"
        status = _in_checkout([*coverage, "run", "-m", "pytest", *arguments])
        _in_checkout([*coverage, "combine", "--quiet"])
        _in_checkout([*coverage, "report", "--skip-covered", "--sort=cover"])
    return status


def _ruff() -> list[int]:
    ruff = [sys.executable, "-P", "-m", "ruff"]
    say("ruff check, ruff format --check")
    return [_in_checkout([*ruff, "check"]), _in_checkout([*ruff, "format", "--check"])]


def _start_second_lane(
    version: str, arguments: list[str], output: BinaryIO
) -> subprocess.Popen | None:
    nfm = [str(CHECKOUT / "nfm"), "--blender", BLENDER[version]]
    if subprocess.run([*nfm, "--which"], capture_output=True).returncode != 0:
        say(f"no Python {version} here: the tests on Blender {BLENDER[version]} are skipped")
        return None
    # before the arguments, of which a -m of the caller's wins
    options = [*_cache(version), *LEFT_TO_THE_FIRST]
    tests = ["python", "-P", "-m", "pytest", *options, *arguments]
    return _started([*nfm, *tests], output)


def _finish(lane: subprocess.Popen, version: str, arguments: list[str], output: BinaryIO) -> int:
    status = lane.wait()
    say(f"pytest on Blender {BLENDER[version]}, which ran at the same time")
    sys.stdout.flush()
    output.seek(0)
    shutil.copyfileobj(output, sys.stdout.buffer)
    sys.stdout.flush()
    # A selection may name tests that this version does not have.
    return 0 if arguments and status == NO_TESTS_COLLECTED else status


def _cache(version: str) -> list[str]:
    return ["-o", f"cache_dir={folder().with_name(f'python{version}') / 'pytest_cache'}"]


def _started(command: list[str], output: BinaryIO) -> subprocess.Popen:
    return subprocess.Popen(command, cwd=CHECKOUT, stdout=output, stderr=subprocess.STDOUT)


def _in_checkout(command: list[str]) -> int:
    return subprocess.call(command, cwd=CHECKOUT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
