# SPDX-License-Identifier: GPL-3.0-or-later
"""What a long session costs in memory and time, and whether anything is left of what was deleted.

1. Parameter files imported and deleted, each with a model of its own, so that nothing is remembered
   from one to the next. Memory is what the process has after each deletion.
2. The file saved and opened.
3. Edits undone and redone. Timers do not run in the background, so the shader is brought up to date
   by hand after each step.
4. A scene with many different materials: made, saved, opened, rendered.

Memory is the resident set of this process (Linux), MB; times are its CPU seconds, renders included.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.models.model import FactorModel
from runner.blender import load_extension

from . import planted

COUNTS = {"imports": 200, "loops": 100, "materials": 64}
MB = 1 << 20
GROWTH = 20.0  # MB between the first quarter of the imports and the last, beyond which it fails


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench session."""
    for name, count in COUNTS.items():
        text = f"default: {count}; 0 leaves that part out"
        parser.add_argument(f"--{name}", metavar="N", type=int, default=count, help=text)


def run(arguments: argparse.Namespace) -> int:
    """Print what came out; returns 1 if anything was left."""
    root = load_extension()
    addon = f"{root.__name__}.nfm_addon"
    modules = {
        name: import_module(f"{addon}.{name}")
        for name in ("material", "live", "rendering", "standard_sphere")
    }
    quiet = modules["rendering"].quiet_console
    left = False
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as name:
        folder = Path(name)
        if arguments.imports:
            left |= _imports(folder, quiet, arguments.imports)
        if arguments.loops:
            left |= _saving(folder, quiet, modules["material"], arguments.loops)
            left |= _undoing(modules, arguments.loops)
        if arguments.materials:
            _many(folder, modules, arguments.materials)
    return int(left)


def model_of(number: int) -> FactorModel:
    """A plausible model, another for every number."""
    rng = np.random.default_rng(number)
    model = planted.model()
    return replace(
        model,
        diffuse=rng.uniform(0, 0.2, 3),
        scale=model.scale * rng.uniform(0.3, 1, (3, 1)),
        ndf=model.ndf ** rng.uniform(0.8, 1.2, (3, 1)),
    ).normalized()


def _imports(folder: Path, quiet: Callable, count: int) -> bool:
    import bpy

    before = _datablocks()
    path, memory, start = folder / "material.nfm.json", [], time.process_time()
    for number in range(count):
        parameter_file.save(path, FittedMaterial(f"material {number}", model_of(number)))
        item = bpy.data.objects.new("Thing", bpy.data.meshes.new("Thing"))
        bpy.context.scene.collection.objects.link(item)
        bpy.context.view_layer.objects.active = item
        with quiet():
            bpy.ops.nfm.import_measurement(filepath=str(path))
            bpy.data.objects.remove(item)
            for material in [*bpy.data.materials]:
                bpy.data.materials.remove(material)
            bpy.ops.outliner.orphans_purge(do_recursive=True)
        memory.append(_resident())
    seconds = (time.process_time() - start) / count
    quarter = max(count // 4, 1)
    grown = np.mean(memory[-quarter:]) - np.mean(memory[quarter : 2 * quarter])
    left = _datablocks() - before
    print(f"{count} imports and deletions: {seconds:.2f} s each, {left} data-blocks left")
    print(f"  memory {memory[0]:.0f} MB after the first, {memory[-1]:.0f} after the last")
    print(f"  mean of the last quarter against that of the second: {grown:+.1f} MB")
    return bool(left) or grown > GROWTH


def _saving(folder: Path, quiet: Callable, material: object, count: int) -> bool:
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    material.build(FittedMaterial("saved", model_of(0))).use_fake_user = True
    path, before, start = folder / "saved.blend", _datablocks(), time.process_time()
    for number in range(count):
        with quiet():
            bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        if number == 0:
            first, memory = path.stat().st_size, _resident()
    left = _datablocks() - before
    print(f"{count} times saved and opened: {(time.process_time() - start) / count:.3f} s each")
    print(
        f"  {first:,} bytes at first, {path.stat().st_size:,} at last; {left} more data-blocks; "
        f"memory {_resident() - memory:+.1f} MB"
    )
    return bool(left)


def _undoing(modules: dict, count: int) -> bool:
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    item = modules["material"].build(FittedMaterial("edited", model_of(0)))
    item.use_fake_user = True
    bpy.ops.ed.undo_push(message="built")
    item.nfm.edit.lobe_1.width = 2.0
    modules["live"].flush()
    bpy.ops.ed.undo_push(message="edited")
    before, start = _datablocks(), time.process_time()
    for number in range(count):
        for step in (bpy.ops.ed.undo, bpy.ops.ed.redo):
            step()
            modules["live"].flush()
        if number == 0:
            memory = _resident()
    left = _datablocks() - before
    print(
        f"{count} times undone and redone: {(time.process_time() - start) / count:.2f} s each, "
        f"{left} more data-blocks, memory {_resident() - memory:+.1f} MB"
    )
    return bool(left)


def _many(folder: Path, modules: dict, count: int) -> None:
    import bpy

    quiet = modules["rendering"].quiet_console
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    empty, start = _resident(), time.process_time()
    materials = [
        modules["material"].build(FittedMaterial(f"material {n}", model_of(n)))
        for n in range(count)
    ]
    print(
        f"{count} materials made: {(time.process_time() - start) / count:.2f} s each, "
        f"memory {(_resident() - empty) / count:+.2f} MB each"
    )
    scene = bpy.context.scene
    side = int(np.ceil(np.sqrt(count)))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    bpy.ops.object.shade_smooth()
    first = bpy.context.object
    first.data.materials.append(None)
    for number, material in enumerate(materials):
        # all of one mesh: what is measured is the materials
        item = first if number == 0 else bpy.data.objects.new(material.name, first.data)
        item.material_slots[0].link = "OBJECT"
        item.material_slots[0].material = material
        item.location = (2.2 * (number % side), 0, 2.2 * (number // side))
        if number:
            scene.collection.objects.link(item)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.2 * side
    camera.location = (1.1 * (side - 1), -4, 1.1 * (side - 1))
    camera.rotation_euler = (np.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = modules["standard_sphere"].new_world(None)
    modules["rendering"].render_settings(scene, 512, 512, 16, 0)
    path = folder / "many.blend"
    with quiet():
        bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, compress=True)
    print(f"  saved, compressed: {path.stat().st_size / MB:.1f} MB")
    start = time.process_time()
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    print(f"  opened in {time.process_time() - start:.2f} s, memory {_resident():.0f} MB")
    picture, start = folder / "many.exr", time.process_time()
    modules["rendering"].render_to_file(bpy.context.scene, picture)
    print(
        f"  512 x 512, 16 samples: {time.process_time() - start:.1f} s, "
        f"at most {_peak():.0f} MB in this process"
    )


def _datablocks() -> int:
    import bpy

    return len(bpy.data.user_map())


def _resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MB


def _peak() -> float:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
