# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials made in a Blender without OSL get their shader where there is one."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..fitter.errors import NfmError
from . import material, script_node


@persistent
def complete_materials(*_arguments: object) -> None:
    """Compile what was never compiled, after a file was opened or something was appended."""
    if not script_node.has_osl():
        return
    for item in bpy.data.materials:
        if item.nfm.parameters and item.is_editable and material.needs_compiling(item):
            try:
                material.complete(item)
            except NfmError as error:
                print(f"nfm: {error}")  # noqa: T201


_HANDLERS = ("load_post", "blend_import_post")


def register() -> None:
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).append(complete_materials)


def unregister() -> None:
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(complete_materials)
