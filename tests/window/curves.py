# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves and sliders dragged with the mouse while the viewport shows them: curves.py -- FOLDER.

FOLDER holds a measured file, first.binary, and gets the pictures. The add-on is installed and
enabled. In a Blender without OSL the stand-in follows.
"""

import sys
from importlib import import_module
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from driver import Window, run

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
ADDON = "bl_ext.user_default.nfm.nfm_addon"


def module(name):
    return import_module(f"{ADDON}.{name}")


def material():
    return bpy.data.objects["Cube"].active_material


def prepare(window):
    """A smooth sphere and its material; a wide properties editor beside the viewport."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, scale=(1.6, 1.6, 1.6))
    ball = bpy.context.active_object
    cube = bpy.data.objects["Cube"]
    cube.data = ball.data
    bpy.data.objects.remove(ball)
    cube.data.shade_smooth()
    cube.data.materials.clear()
    bpy.context.view_layer.objects.active = cube
    cube.select_set(True)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.nfm.import_measurement(filepath=str(FOLDER / "first.binary"), quality="DRAFT")
    yield from window.until(
        "the fit is there", lambda: material() and not module("fitting.queue").queue.jobs
    )
    window.area("PROPERTIES").spaces.active.context = "MATERIAL"
    view = window.area("VIEW_3D")
    view.spaces.active.shading.type = "MATERIAL"
    view.spaces.active.overlay.show_overlays = False
    window.area("DOPESHEET_EDITOR").type = "PROPERTIES"
    yield 3.0
    yield from window.picture("layout")


def session(window):
    yield from prepare(window)


run(session, Window(FOLDER))
