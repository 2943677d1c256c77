# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side: the only package that imports bpy. It joins fitter/ and osl/."""

from bpy.utils import register_submodule_factory

register, unregister = register_submodule_factory(
    __name__,
    (
        "edit_properties",
        "properties",
        "material",
        "preferences",
        "known_shadings",
        "fitting",
        "background_shading",
        "completion",
        "operators",
        "plot_icons",
        "panel",
        "edit_panel",
        "live",
        "command",
    ),
)
