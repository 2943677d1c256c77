# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators, one to a module."""

from bpy.utils import register_submodule_factory

register, unregister = register_submodule_factory(
    __name__,
    (
        "align_brushing",
        "apply_edits",
        "blend_with",
        "cancel_fit",
        "copy_edits",
        "edit_presets",
        "export_measurement",
        "export_parameters",
        "give_lamps_size",
        "import_folder",
        "import_measurement",
        "install_library",
        "make_editable",
        "refit",
        "reset_edits",
        "reset_material",
        "set_up_render",
        "watch_fits",
    ),
)
