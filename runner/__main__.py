"""python -m runner VERB ARGS, as ./nfm calls it: prepare what the verb needs, then become it."""

import os
import sys
from pathlib import Path

from . import debian
from .interruptible import INTERRUPTED
from .messages import SetupError, say
from .verbs import VERBS, Verb, usage

FAILED, BAD_USAGE = 1, 2
NFM = Path(__file__).resolve().parents[1] / "nfm"


def main(arguments: list[str]) -> int:
    """Run a verb; return, with an exit status, only when none could be started."""
    if arguments[:1] in (["--help"], ["-h"], ["help"]):
        print(usage(), end="")
        return 0
    if not arguments:
        print(usage(), end="", file=sys.stderr)
        return BAD_USAGE
    name, *rest = arguments
    if name not in VERBS:
        say(f"there is no verb {name!r}; ./nfm --help lists them")
        return BAD_USAGE
    version = VERBS[name].blender_for(rest)
    try:
        if version and not os.environ.get("NFM_BLENDER"):
            os.execv(NFM, [str(NFM), "--blender", version, *arguments])
        python = _prepare(VERBS[name], rest)
        # numpy's linear algebra, on matrices as small as ours: threads that wait for each other
        # take several times longer than one, most of all while Cycles or other tests run.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        # The verb takes the place of this process: its exit status and its signals are its own.
        os.execv(python, [python, *VERBS[name].command, *rest])
    except (SetupError, OSError) as error:
        say(str(error))
        return FAILED
    except KeyboardInterrupt:
        return INTERRUPTED


def _prepare(verb: Verb, arguments: list[str]) -> str:
    debian.require_whole_python()
    # Only now: these need modules that a minimal Python of Debian's lacks.
    from . import environment, system_libraries

    python = environment.ensure(verb.extras_for(arguments))
    if verb.loads_blender:
        system_libraries.ensure(python)
    return str(python)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
