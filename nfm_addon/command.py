# SPDX-License-Identifier: GPL-3.0-or-later
"""blender --command nfm VERB ARGS: the add-on's command line inside a full Blender."""

from __future__ import annotations

from typing import Any

import bpy

_handle: Any = None


def _run(argv: list[str]) -> int:
    from . import command_line

    return command_line.main(argv)


def register() -> None:
    global _handle
    _handle = bpy.utils.register_cli_command("nfm", _run)


def unregister() -> None:
    bpy.utils.unregister_cli_command(_handle)
