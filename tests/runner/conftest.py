# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm is outside Blender."""

from pathlib import Path


def pytest_collection_modifyitems(items):
    """What starts interpreters that import bpy cannot be tried inside a full Blender."""
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent):
            item.add_marker("module")
