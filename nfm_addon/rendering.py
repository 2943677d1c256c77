# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a scene of our own to a file, and nothing else: other scenes are not touched."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..fitter.errors import NfmError, shown_name
from .whole_files import written_beside

FORMATS = {".exr": "OPEN_EXR", ".png": "PNG"}


def render_settings(
    scene: bpy.types.Scene, width: int, height: int, samples: int, seed: int
) -> None:
    """Cycles with OSL on the CPU, the plain estimator: no denoising, clamping or adaptivity."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = False
    scene.view_settings.view_transform = "Standard"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.shading_system = True
    cycles.samples, cycles.seed = samples, seed
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.pixel_filter_type = "BOX"


def check_output(output: Path) -> str:
    """Blender's name of the format that a file's suffix asks for.

    Raises
    ------
    NfmError
        The suffix is neither .exr nor .png, or no file can be written there.
    """
    name = shown_name(output)
    file_format = FORMATS.get(output.suffix.lower())
    if file_format is None:
        raise NfmError(
            f"{name}: cannot write {output.suffix or 'a file without suffix'}; use .exr or .png"
        )
    if not output.parent.is_dir() or not os.access(output.parent, os.W_OK):
        raise NfmError(f"{name}: its folder does not exist or is read-only; choose another")
    if output.is_dir():
        raise NfmError(f"{name}: is a folder; choose a file name")
    return file_format


def render_to_file(
    scene: bpy.types.Scene, output: Path, on_progress: Callable[[float], None] | None = None
) -> None:
    """Render to .exr (32-bit, linear) or .png (8-bit, sRGB), with alpha if the film is transparent.

    Raises
    ------
    NfmError
        The suffix is neither, or the file cannot be written; an existing file is then kept.
    """
    file_format = check_output(output)
    settings = scene.render.image_settings
    settings.file_format = file_format
    settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
    settings.color_depth = "32" if file_format == "OPEN_EXR" else "8"
    if file_format == "OPEN_EXR":
        settings.exr_codec = "ZIP"
    scene.render.use_file_extension = False
    with written_beside(output) as partial:
        scene.render.filepath = str(partial.resolve())
        with quiet_console(), _progress_handler(on_progress, scene.cycles.samples):
            bpy.ops.render.render(write_still=True, scene=scene.name)


def remove_scene(scene: bpy.types.Scene) -> None:
    """Remove a scene of ours with its objects, their data, its world and map; materials stay."""
    objects = list(scene.objects)
    data = {item.data for item in objects}
    worlds = [scene.world] if scene.world else []
    images = [
        node.image
        for world in worlds
        for node in world.node_tree.nodes
        if node.type == "TEX_ENVIRONMENT"
    ]
    bpy.data.batch_remove([scene, *objects, *data, *worlds, *images])


@contextmanager
def quiet_console() -> Iterator[None]:
    """Keep Blender's own lines off standard output, which belongs to a report."""
    sys.stdout.flush()
    saved = os.dup(1)
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, 1)
    os.close(sink)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)


@contextmanager
def _progress_handler(on_progress: Callable[[float], None] | None, samples: int) -> Iterator[None]:
    """Call on_progress with the share of samples, read from the statistics that Cycles shows."""
    if on_progress is None:
        yield
        return

    def handler(statistics: str, *_arguments: object) -> None:
        # "... | Sample 17/64"
        _, found, tail = str(statistics).rpartition("Sample ")
        done = tail.partition("/")[0]
        if found and done.isdigit():
            on_progress(int(done) / samples)

    bpy.app.handlers.render_stats.append(handler)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(handler)
