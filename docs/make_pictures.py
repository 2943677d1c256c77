# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pictures of the documentation: ./nfm python docs/make_pictures.py.

Everything in them is our own: synthetic samples, fitted, under a synthetic studio.
"""

import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(CHECKOUT))

from runner.blender import load_extension  # noqa: E402

SAMPLES = ("copper-paint", "glossy-plastic", "velvet")
RESOLUTION = 320


def main() -> None:
    """Three fitted samples on the standard sphere, side by side."""
    root = load_extension().__name__

    def load(name: str) -> object:
        return import_module(f"{root}.{name}")

    images, sphere = load("nfm_addon.images"), load("nfm_addon.standard_sphere")
    rendering, material = load("nfm_addon.rendering"), load("nfm_addon.material")
    pictures = []
    with tempfile.TemporaryDirectory(prefix="nfm-") as folder:
        environment, picture = Path(folder, "studio.exr"), Path(folder, "picture.exr")
        images.write_linear(environment, load("nfm_addon.demo_light").studio())
        for name in SAMPLES:
            measured = Path(folder, f"{name}.binary")
            load("fitter.synthetic").write_sample(measured, name)
            fitted = load("fitter.fit_file").material_from_file(measured)
            view = sphere.SphereView(resolution=RESOLUTION, samples=1024, environment=environment)
            scene = sphere.build_scene(material.build(fitted), view)
            rendering.render_to_file(scene, picture)
            pictures.append(images.read_linear(picture))
    path = CHECKOUT / "docs" / "images" / "standard_sphere.png"
    path.parent.mkdir(exist_ok=True)
    images.write_picture(path, np.concatenate(pictures, axis=1))


main()
