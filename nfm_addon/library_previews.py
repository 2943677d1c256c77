# SPDX-License-Identifier: GPL-3.0-or-later
"""Previews of the material library: the standard sphere in the studio of the demo."""

from __future__ import annotations

import tempfile
from pathlib import Path

from ..fitter.formats import parameter_file
from . import demo_light, images, material, rendering
from .standard_sphere import SphereView, build_scene

SIZE = 192
SAMPLES = 64  # and a denoiser


def render(parameters: Path, picture: Path, samples: int = SAMPLES, size: int = SIZE) -> None:
    """Render the preview of a parameter file to a .png with alpha.

    Raises
    ------
    NfmError
        A file cannot be read or written, or this Blender cannot compile the shader.
    """
    new = material.build(parameter_file.load(parameters))
    try:
        with tempfile.TemporaryDirectory(prefix="nfm-") as folder:
            studio = Path(folder, "studio.exr")
            images.write_linear(studio, demo_light.studio())
            view = SphereView(resolution=size, samples=samples, environment=studio)
            scene = build_scene(new, view)
            scene.render.film_transparent = True
            scene.cycles.use_denoising = True
            scene.cycles.denoiser = "OPENIMAGEDENOISE"
            scene.render.dither_intensity = 0  # noise costs bytes
            scene.render.image_settings.compression = 100
            rendering.render_to_file(scene, picture)
            rendering.remove_scene(scene)
    finally:
        material.remove(new)
