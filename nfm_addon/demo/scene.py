# SPDX-License-Identifier: GPL-3.0-or-later
"""Put the scene of the demo together, and write it as a file that needs nothing else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import bpy

from ...fitter.errors import NfmError, shown_name
from .. import material
from ..cloth_scene import ROTATIONS, cloth_mesh, turned
from ..drape import BALL_RADIUS
from ..rendering import quiet_console
from ..whole_files import written_beside
from . import materials, stage
from .forms import ball_mesh, disc_mesh, form_mesh

NAME = "Demo"
FILE_NAME = "demo.blend"

FORM_SPACING, CLOTH_SPACING = 1.52, 1.98
FORM_TURN = 0.35  # radians from one form to the next, so that their flutes differ
CLOTH_TURN = math.radians(20)
CLOTH_LIFT = 1.14  # of the middle of the balls above the step

DARK = (0.03, 0.03, 0.032, 1.0)

ABOUT = """Measured materials in Cycles: forms of our own under soft boxes of our own.

Front row: Sunflower (measured), brushed aluminium (anisotropic), Green Malachite (measured), gold
edited with sliders and a curve. Behind: velvet, porcelain, and a paint blended with copper. The
cloths show one woven material (anisotropic) at a Rotation of 0, 45 and 90 degrees.

Measured materials are fits of files of the RGL material database (CC0 1.0); the others are
synthetic, as their names say. All are in the material library of the add-on.

Render with Cycles on the CPU with Open Shading Language, as this file is set up:

    blender -b demo.blend -f 1

The picture needs no add-on; sliders and curves do. ./nfm demo --rebuild writes this file.
"""


def build_scene() -> bpy.types.Scene:
    """A new scene with all of it.

    Raises
    ------
    NfmError
        A file of the material library is missing, or this Blender cannot compile a shader.
    """
    scene = bpy.data.scenes.new(NAME)
    stage.add_stage(scene)
    forms = [material.build(materials.entry(key)) for key in materials.PLAIN]
    forms[3:3] = [materials.edited()]
    forms.append(materials.blended())
    mesh = form_mesh()
    for (place, number), shown in zip(_places(), forms, strict=True):
        item = _object(scene, shown.name, mesh, shown)
        item.location = place
        item.rotation_euler.z = FORM_TURN * number
    _add_cloths(scene)
    stage.set_up_render(scene)
    return scene


def _places() -> Iterator[tuple[tuple[float, float, float], int]]:
    """Four in the front row, three in the next."""
    number = 0
    for count, (y, z) in zip((4, 3), stage.ROWS, strict=False):
        for column in range(count):
            yield ((column - (count - 1) / 2) * FORM_SPACING, y, z), number
            number += 1


def _add_cloths(scene: bpy.types.Scene) -> None:
    """The woven material at three rotations, each cloth on a ball on a foot."""
    y, z = stage.ROWS[2]
    woven = material.build(materials.entry(materials.WOVEN))
    cloth, ball = cloth_mesh(), ball_mesh(BALL_RADIUS - 0.02)
    foot = disc_mesh("Foot", 0.09, CLOTH_LIFT - BALL_RADIUS + 0.05, 0.01)
    dark = stage.plain_material("Ball and Foot", DARK)
    for column, rotation in enumerate(ROTATIONS):
        shown = turned(woven, rotation)
        shown.name = f"{woven.name}, {rotation:.0f} degrees"
        place = (CLOTH_SPACING * (column - 1), y, z)
        item = _object(scene, f"Cloth, {rotation:.0f} degrees", cloth, shown)
        item.location = (*place[:2], z + CLOTH_LIFT)
        item.rotation_euler.z = CLOTH_TURN
        _object(scene, "Ball", ball, dark).location = item.location
        _object(scene, "Foot", foot, dark).location = place
    material.remove(woven)


def _object(
    scene: bpy.types.Scene, name: str, mesh: bpy.types.Mesh, shown: bpy.types.Material
) -> bpy.types.Object:
    """A new object of a mesh that others use too, with a material of its own."""
    item = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(item)
    if not mesh.materials:
        mesh.materials.append(None)
    item.material_slots[0].link = "OBJECT"
    item.material_slots[0].material = shown
    return item


def write(path: Path) -> None:
    """Write demo.blend, all or nothing. The file that is open in this Blender is closed unsaved.

    Raises
    ------
    NfmError
        This Blender's files cannot be opened by the oldest one that is supported, or the file
        cannot be written, or as build_scene.
    """
    if bpy.app.version >= (5, 0, 0):
        raise NfmError(
            f"{shown_name(path)}: has to be written by Blender 4.5, or 4.5 cannot open it; "
            "run ./nfm --blender 4.5 demo --rebuild"
        )
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = build_scene()
    _show(scene)
    bpy.data.texts.new("About").from_string(ABOUT)
    with written_beside(path) as partial, quiet_console():
        bpy.ops.wm.save_as_mainfile(
            filepath=str(partial), compress=True, copy=True, relative_remap=False
        )


def _show(scene: bpy.types.Scene) -> None:
    """Have the scene, and no other, in all windows, seen through its camera."""
    for window in bpy.context.window_manager.windows:
        window.scene = scene
    bpy.data.batch_remove([other for other in bpy.data.scenes if other != scene])
    for area in [area for screen in bpy.data.screens for area in screen.areas]:
        for space in area.spaces:
            if space.type == "VIEW_3D":
                space.region_3d.view_perspective = "CAMERA"
            elif space.type == "FILE_BROWSER" and space.params:
                space.params.directory = b"//"  # it has the home of whoever writes the file
