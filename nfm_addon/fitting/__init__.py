# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits outside the interface: a process for each, a queue of them, and where their results land."""

from bpy.utils import register_submodule_factory

register, unregister = register_submodule_factory(__name__, ("queue", "landing", "status_bar"))
