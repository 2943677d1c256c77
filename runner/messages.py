"""How the runner speaks: plain lines on stderr, because stdout belongs to the verbs."""

import sys


class SetupError(Exception):
    """The machine cannot run the verb yet; the text says what to do about it."""


def say(line: str) -> None:
    """Print one line about something slow or unusual."""
    print(f"nfm: {line}", file=sys.stderr, flush=True)
