"""python -m runner.interruptible MODULE ARGS: like python -m MODULE ARGS, with a quiet Ctrl-C."""

import os
import runpy
import signal
import sys
import threading
import time

INTERRUPTED = 128 + signal.SIGINT  # what a shell reports
GRACE_SECONDS = 2.0


def main() -> None:
    """Run the module as the main program; exit with 130 when it is interrupted."""
    module = sys.argv.pop(1)
    _leave_when_stuck()
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


def _leave_when_stuck() -> None:
    """End the process some time after Ctrl-C if Python does not get to it.

    A render in the bpy module runs to its end before Python sees the signal.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer)

    def wait() -> None:
        while os.read(reader, 1)[0] != signal.SIGINT:
            pass
        time.sleep(GRACE_SECONDS)
        os._exit(INTERRUPTED)

    threading.Thread(target=wait, daemon=True).start()


if __name__ == "__main__":
    main()
