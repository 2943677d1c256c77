# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps a scene from rendering measured materials, and the one click that changes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_iface as iface_

from . import script_node

# Kinds of GPU devices on which Cycles runs OSL.
OSL_DEVICES = ("OPTIX",)


@dataclass(frozen=True)
class Obstacle:
    """Something in the way.

    problem : what the panel says
    change : what `remove` does, as it is reported afterwards
    remove : None if it cannot be changed from here
    """

    problem: str
    change: str = ""
    remove: Callable[[bpy.types.Scene], None] | None = None


def obstacles(context: bpy.types.Context) -> list[Obstacle]:
    """What is in the way in the context's scene, the most important first."""
    scene = context.scene
    if not script_node.has_osl():
        text = iface_("This Blender has no Open Shading Language; it shows a stand-in")
        return [Obstacle(text)]
    if not hasattr(scene, "cycles"):
        return [Obstacle(iface_("The add-on Cycles is switched off in the preferences"))]
    found = []
    if scene.render.engine != "CYCLES":
        found.append(
            Obstacle(
                iface_("The render engine is not Cycles; it shows a stand-in"),
                iface_("render engine: Cycles"),
                _use_cycles,
            )
        )
    if not scene.cycles.shading_system:
        found.append(
            Obstacle(
                iface_("Open Shading Language is off"),
                iface_("Open Shading Language: on"),
                _use_osl,
            )
        )
    if scene.cycles.device == "GPU" and not _gpu_runs_osl(context.preferences):
        found.append(
            Obstacle(
                iface_("The GPU cannot run Open Shading Language"),
                iface_("device: CPU"),
                _use_cpu,
            )
        )
    return found


def set_up(context: bpy.types.Context) -> list[str]:
    """Remove what can be removed; returns the changes."""
    changes = []
    for obstacle in obstacles(context):
        if obstacle.remove:
            obstacle.remove(context.scene)
            changes.append(obstacle.change)
    return changes


def _gpu_runs_osl(preferences: bpy.types.Preferences) -> bool:
    """Whether it does; also where no GPU is chosen and Cycles falls back to the CPU."""
    cycles = preferences.addons.get("cycles")
    kind = cycles.preferences.compute_device_type if cycles else "NONE"
    return kind in ("NONE", *OSL_DEVICES)


def _use_cycles(scene: bpy.types.Scene) -> None:
    scene.render.engine = "CYCLES"


def _use_osl(scene: bpy.types.Scene) -> None:
    scene.cycles.shading_system = True


def _use_cpu(scene: bpy.types.Scene) -> None:
    scene.cycles.device = "CPU"
