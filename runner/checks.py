"""./nfm test: ruff, then pytest once per Blender version.

The lanes share nothing: each has its interpreter, its environment and its pytest cache.
"""

import os
import subprocess
import sys

from .environment import CHECKOUT, folder
from .messages import say

# Blender version of each Python version, as the pins in pyproject.toml have it.
BLENDER = {"3.13": "5.2", "3.11": "4.5"}

NO_TESTS_COLLECTED = 5  # pytest's exit status


def main(arguments: list[str]) -> int:
    """Run everything, also after a failure; return the first exit status that is not 0.

    Arguments are pytest's. Who gives some is after certain tests, so ruff is left out.
    """
    here = "{}.{}".format(*sys.version_info[:2])
    alone = bool(os.environ.get("NFM_BLENDER"))
    # A test that starts ./nfm stays in its lane.
    os.environ["NFM_BLENDER"] = BLENDER[here]

    statuses = [] if arguments else _ruff()
    say(f"pytest on Blender {BLENDER[here]}")
    cache = ["-o", f"cache_dir={folder() / 'pytest_cache'}"]
    statuses.append(_in_checkout([sys.executable, "-P", "-m", "pytest", *cache, *arguments]))
    if not alone:
        (other,) = BLENDER.keys() - {here}
        statuses.append(_second_lane(other, arguments))
    return next((status for status in statuses if status != 0), 0)


def _ruff() -> list[int]:
    ruff = [sys.executable, "-P", "-m", "ruff"]
    say("ruff check, ruff format --check")
    return [_in_checkout([*ruff, "check"]), _in_checkout([*ruff, "format", "--check"])]


def _second_lane(version: str, arguments: list[str]) -> int:
    nfm = [str(CHECKOUT / "nfm"), "--blender", BLENDER[version]]
    if subprocess.run([*nfm, "--which"], capture_output=True).returncode != 0:
        say(f"no Python {version} here: the tests on Blender {BLENDER[version]} are skipped")
        return 0
    say(f"pytest on Blender {BLENDER[version]}")
    cache = ["-o", f"cache_dir={folder().with_name(f'python{version}') / 'pytest_cache'}"]
    status = _in_checkout([*nfm, "python", "-P", "-m", "pytest", *cache, *arguments])
    # A selection may name tests that this version does not have.
    return 0 if arguments and status == NO_TESTS_COLLECTED else status


def _in_checkout(command: list[str]) -> int:
    return subprocess.call(command, cwd=CHECKOUT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
