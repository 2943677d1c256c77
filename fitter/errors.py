# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong with a user's files.

Every message names the file, what was found, what was expected and what to do next; it is shown
to the user as it stands.
"""

from __future__ import annotations

import os
from pathlib import Path


class NfmError(ValueError):
    """A file or value from outside that cannot be used."""


class MeasurementError(NfmError):
    """A measured BRDF file that cannot be read or fitted."""


class ParameterFileError(NfmError):
    """An .nfm.json parameter file that cannot be read or written."""


def shown_name(path: str | os.PathLike) -> str:
    """Name of a file, without its folders, as messages show it.

    Names come from strangers: what does not print (newlines, control and direction characters,
    bytes that are not UTF-8), quotes and backslashes are shown as Python escapes.
    """
    text = os.fsdecode(path)
    return printable(Path(text).name or text)


def printable(text: str) -> str:
    """Text from a stranger for messages: on one line, without characters that steer a terminal."""
    return "".join(map(_escaped, text))


def _escaped(character: str) -> str:
    if character in "\"'\\":
        return "\\" + character
    if character.isprintable():
        return character
    return character.encode("unicode_escape").decode("ascii")
