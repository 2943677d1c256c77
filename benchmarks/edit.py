# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds from an edit to new bytecode, and what the add-on does while other things change.

A handle is moved, or a slider, and the shader brought up to date: as a draft, as while a person
drags, and finished, as for a render; then both with Keep Energy and lobes that are too bright. CPU
time of this process, the median of several edits.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from statistics import median
from types import ModuleType

from fitter.formats.parameter_file import FittedMaterial
from runner.blender import load_extension

from . import planted, shared_data

ANISOTROPIC = "(anisotropic)"  # of no measurement: the planted model
MATERIALS = ("silver-metallic-paint", "blue-rubber", "brass", ANISOTROPIC)
COLUMNS = ("draft, ms CPU", "finished", "gain", "draft, kept", "finished, kept")
DRAFTS = ("draft, ms CPU", "draft, kept")
TOO_MUCH = 5.0  # gain of every lobe, for Keep Energy to have something to do
LIMITS = {"native": 0.150, "exact": 0.400}
N_OBJECTS = 500


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench edit."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(MATERIALS))
    parser.add_argument("--fits", metavar="DIR", type=Path, help="keeps fits, and uses them")
    parser.add_argument("--edits", metavar="N", type=int, default=9)


def run(arguments: argparse.Namespace) -> int:
    """Print a line for each material and sampling; returns 1 if a limit is missed."""
    shared_data.require_shared()
    addon = f"{load_extension().__name__}.nfm_addon"
    editing, material = (import_module(f"{addon}.{name}") for name in ("editing", "material"))
    missed = 0
    print(f"{'material':<24}{'sampling':<11}" + "".join(f"{name:>15}" for name in COLUMNS))
    for name in arguments.materials.split(","):
        fitted = _fitted(name, arguments.fits)
        for wanted, limit in LIMITS.items():
            owner = material.build(fitted, wanted.upper())
            sampling = owner.nfm.sampling.lower()
            seconds = _seconds(editing, owner, arguments.edits)
            shown = (f"{1e3 * value:15.1f}" for value in seconds.values())
            print(f"{name:<24}{sampling:<11}" + "".join(shown), flush=True)
            missed += max(seconds[column] for column in DRAFTS) > limit
    ours, whole = _idle_seconds(import_module(f"{addon}.live"))
    print(
        f"\n{N_OBJECTS} other objects moving: {1e6 * ours:.0f} us of the add-on in an update of "
        f"{1e3 * whole:.1f} ms"
    )
    print(
        f"drafts: {missed} of them above {LIMITS}" if missed else "all drafts within their limits"
    )
    return 1 if missed else 0


def _fitted(name: str, folder: Path | None) -> FittedMaterial:
    if name == ANISOTROPIC:
        return FittedMaterial(name, planted.anisotropic_model())
    return shared_data.fitted_material(name, folder)


def _seconds(editing: ModuleType, owner: object, count: int) -> dict[str, float]:
    """Median CPU seconds of each of COLUMNS."""
    seconds = [
        _median(editing, owner, count, _drag, draft=True),
        _median(editing, owner, count, _drag),
        _median(editing, owner, count, _gain),
    ]
    edit = owner.nfm.edit
    edit.lobe_1.gain = edit.lobe_2.gain = edit.lobe_3.gain = TOO_MUCH
    edit.keep_energy = True
    editing.refresh(owner)
    seconds += [
        _median(editing, owner, count, _drag, draft=True),
        _median(editing, owner, count, _drag),
    ]
    return dict(zip(COLUMNS, seconds, strict=True))


def _median(
    editing: ModuleType, owner: object, count: int, edit: Callable, **options: bool
) -> float:
    """Median CPU seconds of `refresh` after an edit that was never made before."""
    known = import_module(f"{editing.__name__.rpartition('.')[0]}.known_shadings")
    seconds = []
    for number in range(count):
        edit(editing, owner, number)
        known.forget()
        start = time.process_time()
        if not editing.refresh(owner, **options):
            raise RuntimeError("an edit went unnoticed")
        seconds.append(time.process_time() - start)
    return median(seconds)


def _drag(editing: ModuleType, owner: object, number: int) -> None:
    mapping = editing.group_of(owner).nodes["Lobe 2 D"].mapping
    down = (0.01 + 0.001 * number) * (-1) ** (number // 3)  # never back to where it was
    mapping.curves[0].points[4].location[1] -= down
    mapping.update()


def _gain(_editing: ModuleType, owner: object, number: int) -> None:
    owner.nfm.edit.lobe_1.gain = 2 + number


def _idle_seconds(live: ModuleType, updates: int = 50) -> tuple[float, float]:
    """Seconds of our handler in an update that moves other objects, and of the whole update."""
    import bpy

    scene, layer = bpy.context.scene, bpy.context.view_layer
    things = [bpy.data.objects.new(f"object {number}", None) for number in range(N_OBJECTS)]
    for thing in things:
        scene.collection.objects.link(thing)
    handlers = bpy.app.handlers.depsgraph_update_post
    inside = []

    def timed(*arguments: object) -> None:
        start = time.perf_counter()
        live._on_update(*arguments)
        inside.append(time.perf_counter() - start)

    handlers.remove(live._on_update)
    handlers.append(timed)
    layer.update()
    inside.clear()
    start = time.perf_counter()
    for step in range(updates):
        for thing in things:
            thing.location.x = step + 1
        layer.update()
    whole = time.perf_counter() - start
    handlers.remove(timed)
    handlers.append(live._on_update)
    return sum(inside) / updates, whole / updates
