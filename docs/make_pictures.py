# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pictures of the documentation: ./nfm python docs/make_pictures.py.

Everything in them is our own: synthetic samples, fitted, under a synthetic studio.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(CHECKOUT))

from runner.blender import load_extension  # noqa: E402

SAMPLES = ("copper-paint", "glossy-plastic", "velvet")
EDITED = "copper-paint"
RESOLUTION = 400
SAMPLES_PER_PIXEL = 64
IMAGES = CHECKOUT / "docs" / "images"

Load = Callable[[str], ModuleType]


class Studio:
    """Fitted samples, and pictures of materials on the standard sphere."""

    def __init__(self, load: Load, folder: Path) -> None:
        self.load, self._folder = load, folder
        self._images = load("nfm_addon.images")
        self._environment = folder / "studio.exr"
        self._images.write_linear(self._environment, load("nfm_addon.demo_light").studio())

    def material(self, sample: str) -> object:
        """A new material of a synthetic sample."""
        measured = self._folder / f"{sample}.binary"
        self.load("fitter.synthetic").write_sample(measured, sample)
        fitted = self.load("fitter.jobs.fit_file").material_from_file(measured)
        return self.load("nfm_addon.material").build(fitted)

    def picture(self, material: object) -> np.ndarray:
        """Linear pixels (h, w, 3)."""
        sphere = self.load("nfm_addon.standard_sphere")
        view = sphere.SphereView(
            resolution=RESOLUTION, samples=SAMPLES_PER_PIXEL, environment=self._environment
        )
        path = self._folder / "picture.exr"
        scene = sphere.build_scene(material, view)
        scene.cycles.use_denoising = True  # to be looked at, not to be measured
        self.load("nfm_addon.rendering").render_to_file(scene, path)
        return self._images.read_linear(path)

    def write(self, name: str, rows: list[list[np.ndarray]]) -> None:
        """Write pictures in rows."""
        IMAGES.mkdir(exist_ok=True)
        pixels = np.concatenate([np.concatenate(row, axis=1) for row in rows])
        self._images.write_picture(IMAGES / name, pixels)


def main() -> None:
    """Write every picture."""
    root = load_extension().__name__
    with tempfile.TemporaryDirectory(prefix="nfm-") as folder:
        studio = Studio(lambda name: import_module(f"{root}.{name}"), Path(folder))
        samples = [studio.picture(studio.material(name)) for name in SAMPLES]
        studio.write("standard_sphere.png", [samples])
        edits = [studio.picture(material) for material in edited_materials(studio)]
        studio.write("edits.png", [edits[:3], edits[3:]])


def edited_materials(studio: Studio) -> Iterator[object]:
    """One material as measured, then under five edits, each alone."""
    editing, nodes = studio.load("nfm_addon.editing"), studio.load("nfm_addon.curve_nodes")
    set_sliders = studio.load("nfm_addon.edit_properties").set_sliders
    sliders = studio.load("fitter.editing.edits").Sliders()
    velvet = editing.fitted_material(studio.material("velvet"))
    material = studio.material(EDITED)
    edit = material.nfm.edit
    yield material
    edit.lobe_1.width = 4.0
    yield material
    set_sliders(edit, sliders)
    edit.lobe_1.haze = 0.8
    yield material
    set_sliders(edit, sliders)
    edit.edge_tint, edit.edge_strength = (0.15, 0.4, 1.0), 5.0
    yield material
    set_sliders(edit, sliders)
    # the wide highlights cut off by hand
    handles = [(0.0, 1.0, "AUTO"), (0.4, 0.97, "AUTO"), (0.45, 0.3, "AUTO"), (1.0, 0.0, "AUTO")]
    nodes.write(editing.group_of(material), {"Lobe 2 D": handles, "Lobe 3 D": handles})
    yield material
    editing.reset_curves(material)
    edit.blend_name = "velvet"
    edit.blend_parameters = studio.load("fitter.formats.parameter_file").dumps(velvet)
    edit.blend = 0.6
    yield material


if __name__ == "__main__":
    main()
