# SPDX-License-Identifier: GPL-3.0-or-later
"""Entry point of the Blender extension.

nfm_addon is imported when Blender registers the extension, not when this file is:
pytest runs this file too, and pure tests must not load bpy.
"""


def register():
    """Register every class, property and command of the add-on."""
    from . import nfm_addon

    nfm_addon.register()


def unregister():
    """Undo register()."""
    from . import nfm_addon

    nfm_addon.unregister()
