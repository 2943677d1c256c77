# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user prefers, in Edit > Preferences > Add-ons."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
from bpy.props import BoolProperty, StringProperty
from bpy.utils import register_classes_factory

from .. import __package__ as base_package
from ..fitter.fitting.quality import DEFAULT_QUALITY
from . import material_library
from .fit_options import quality_option


class NFM_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the add-on."""

    bl_idname = base_package

    quality: quality_option("Quality that the import dialog starts with", "Default Quality")
    library_path: StringProperty(
        name="Library",
        description="Folder in which presets and imported folders are saved; empty: a folder of "
        "the add-on",
        subtype="DIR_PATH",
    )
    automatic_set_up: BoolProperty(
        name="Automatic Render Set-up",
        description="Switch the scene to Cycles with Open Shading Language when a material is "
        "imported, and say so; otherwise the panel offers a button",
        default=False,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "quality")
        layout.prop(self, "library_path", placeholder=str(library_folder_by_default()))
        layout.prop(self, "automatic_set_up")
        draw_library(layout)


def draw_library(layout: bpy.types.UILayout) -> None:
    """A button that installs the material library, or removes it once it is there."""
    if material_library.registered():
        layout.operator("nfm.remove_library", icon="X")
    else:
        layout.operator("nfm.install_library", icon="ASSET_MANAGER")


# Where the add-on is enabled for a session only, as scripts do, Blender keeps no preferences.
DEFAULTS = SimpleNamespace(quality=DEFAULT_QUALITY.upper(), library_path="", automatic_set_up=False)


def preferences_of(context: bpy.types.Context) -> NFM_AP_preferences | SimpleNamespace:
    """The add-on's preferences."""
    entry = context.preferences.addons.get(base_package)
    return entry.preferences if entry else DEFAULTS


def library_folder(context: bpy.types.Context) -> Path:
    """Folder of presets, as preferred; it is made if it does not exist."""
    chosen = preferences_of(context).library_path
    folder = Path(bpy.path.abspath(chosen)) if chosen else library_folder_by_default()
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def library_folder_by_default() -> Path:
    """The add-on's own folder among the user's extensions."""
    return Path(bpy.utils.extension_path_user(base_package, path="presets"))


register, unregister = register_classes_factory((NFM_AP_preferences,))
