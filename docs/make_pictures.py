# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the pictures of the documentation: ./nfm python docs/make_pictures.py [NAME ...].

Materials of spheres and the light on them are synthetic. Without names all pictures are made; the
names are those of the files in docs/images, without their suffix.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(CHECKOUT))

from runner.blender import leave, load_extension  # noqa: E402

SAMPLES = ("copper-paint", "glossy-plastic", "velvet")
EDITED = "copper-paint"
RESOLUTION = 400
SAMPLES_PER_PIXEL = 64
IMAGES = CHECKOUT / "docs" / "images"

# Pictures of controls: pairs of before and after, with a gap between pairs.
CONTROL_RESOLUTION, CONTROL_SAMPLES = 144, 16
GAP = 10
BRIGHT = (1.0, 1.0, 1.0)

# A lamp and few samples, not denoised: what samplings differ in.
LAMP_PLACE, LAMP_RADIUS, LAMP_POWER = (2.0, -3.0, 2.0), 0.1, 300.0
LAMP_RESOLUTION, LAMP_SAMPLES = 200, 16

Load = Callable[[str], ModuleType]
Edit = Callable[[object], None]


class Studio:
    """Materials, and pictures of them on the standard sphere."""

    def __init__(self, load: Load, folder: Path) -> None:
        self.load, self._folder = load, folder
        self._images = load("nfm_addon.images")
        self._environment = folder / "studio.exr"
        self._images.write_linear(self._environment, load("nfm_addon.demo_light").studio())
        self.sample = cache(self._sample)
        self._scene = cache(self._new_scene)

    def _sample(self, name: str) -> object:
        measured = self._folder / f"{name}.binary"
        self.load("fitter.synthetic").write_sample(measured, name)
        return self.load("fitter.jobs.fit_file").material_from_file(measured)

    def material(self, sample: str) -> object:
        """A new material of a synthetic sample."""
        return self.load("nfm_addon.material").build(self.sample(sample))

    def from_library(self, key: str) -> object:
        """A new material of the shipped library."""
        return self.load("nfm_addon.material").build(
            self.load("nfm_addon.demo.materials").entry(key)
        )

    def _new_scene(self, resolution: int) -> object:
        sphere = self.load("nfm_addon.standard_sphere")
        view = sphere.SphereView(
            resolution=resolution, samples=SAMPLES_PER_PIXEL, environment=self._environment
        )
        scene = sphere.build_scene(self.from_library("paper-white"), view)
        if resolution == CONTROL_RESOLUTION:
            scene.cycles.samples = CONTROL_SAMPLES
        scene.cycles.use_denoising = True  # to be looked at, not to be measured
        return scene

    def picture(self, material: object, resolution: int = RESOLUTION) -> np.ndarray:
        """Linear pixels (h, w, 3)."""
        scene = self._scene(resolution)
        (sphere,) = [item for item in scene.objects if item.type == "MESH"]
        sphere.data.materials[0] = material
        return self.render(scene)

    def render(self, scene: object) -> np.ndarray:
        """Linear pixels (h, w, 3) of a scene."""
        path = self._folder / "picture.exr"
        self.load("nfm_addon.rendering").render_to_file(scene, path)
        return self._images.read_linear(path)

    def write(self, name: str, rows: list[list[np.ndarray]]) -> None:
        """Write pictures in rows."""
        IMAGES.mkdir(exist_ok=True)
        pixels = np.concatenate([np.concatenate(row, axis=1) for row in rows])
        self._images.write_picture(IMAGES / f"{name}.png", pixels)


def main(names: list[str]) -> int:
    """Write the pictures of these names, or all."""
    if unknown := set(names) - set(PICTURES):
        sys.stderr.write(f"no such picture: {unknown.pop()}; there are {', '.join(PICTURES)}\n")
        return 2
    root = load_extension().__name__
    with tempfile.TemporaryDirectory(prefix="nfm-") as folder:
        studio = Studio(lambda name: import_module(f"{root}.{name}"), Path(folder))
        for name in names or PICTURES:
            pictures = PICTURES[name](studio)
            if pictures:
                studio.write(name, pictures)
    return 0


def standard_sphere(studio: Studio) -> list[list[np.ndarray]]:
    """Three samples."""
    return [[studio.picture(studio.material(name)) for name in SAMPLES]]


def edits(studio: Studio) -> list[list[np.ndarray]]:
    """One material as measured, then under five edits."""
    pictures = [studio.picture(material) for material in edited_materials(studio)]
    return [pictures[:3], pictures[3:]]


def edited_materials(studio: Studio) -> Iterator[object]:
    """One material as measured, then under five edits, each alone."""
    editing, nodes = studio.load("nfm_addon.editing"), studio.load("nfm_addon.curve_nodes")
    set_sliders = studio.load("nfm_addon.edit_properties").set_sliders
    sliders = studio.load("fitter.editing.edits").Sliders()
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
    nodes.write(editing.group_of(material), {"Lobe 2 D": CUT_OFF, "Lobe 3 D": CUT_OFF})
    yield material
    editing.reset_curves(material)
    blend(studio, material, studio.sample("velvet"), 0.6)
    yield material


CUT_OFF = [(0.0, 1.0, "AUTO"), (0.4, 0.97, "AUTO"), (0.45, 0.3, "AUTO"), (1.0, 0.0, "AUTO")]


def blend(studio: Studio, material: object, other: object, share: float) -> None:
    """Blend a material with a fitted one."""
    edit = material.nfm.edit
    edit.blend_name = other.name
    edit.blend_parameters = studio.load("fitter.formats.parameter_file").dumps(other)
    edit.blend = share


def curves(studio: Studio, handles: dict, material: object) -> None:
    """Draw curves by hand."""
    group = studio.load("nfm_addon.editing").group_of(material)
    full = {name: [(x, y, "AUTO") for x, y in points] for name, points in handles.items()}
    studio.load("nfm_addon.curve_nodes").write(group, full)


def slid(material: object, **sliders: object) -> None:
    """Set sliders: of the material, or lobe_1_width and the like."""
    for name, value in sliders.items():
        lobe, slider = name[:6], name[7:]
        if lobe in ("lobe_1", "lobe_2", "lobe_3"):
            setattr(getattr(material.nfm.edit, lobe), slider, value)
        else:
            setattr(material.nfm.edit, name, value)


def socket(studio: Studio, name: str, value: object, material: object) -> None:
    """Type a value into the node of a material."""
    studio.load("nfm_addon.node_group").find_group_node(material).inputs[name].default_value = value


def listen(switch: str, lobe: int, material: object) -> None:
    """Mute a lobe or put it on solo."""
    getattr(material.nfm, switch)[lobe - 1] = True


def pairs(
    studio: Studio, controls: list[tuple[str, Edit] | tuple[str, Edit, Edit]]
) -> list[list[np.ndarray]]:
    """A row of pairs, before and after, of (material of the library, change[, change before])."""
    gap = np.ones((CONTROL_RESOLUTION, GAP, 3)) * BRIGHT
    row = []
    for key, change, *preparation in controls:
        material = studio.from_library(key)
        for prepare in preparation:
            prepare(material)
        row.append(studio.picture(material, CONTROL_RESOLUTION))
        change(material)
        row += [studio.picture(material, CONTROL_RESOLUTION), gap]
    return [row[:-1]]


def controls_lobes(studio: Studio) -> list[list[np.ndarray]]:
    """Sliders of one lobe."""
    return pairs(
        studio,
        [
            ("car-paint-copper", partial(slid, lobe_1_width=4.0)),
            ("car-paint-copper", partial(slid, lobe_1_haze=0.8)),
            ("satin-gold", partial(slid, lobe_1_falloff=4.0, lobe_2_falloff=4.0, lobe_3_falloff=4)),
            ("car-paint-copper", partial(slid, lobe_1_gain=6.0)),
        ],
    )


def controls_colour(studio: Studio) -> list[list[np.ndarray]]:
    """Sliders of the edge and of reflections."""
    return pairs(
        studio,
        [
            ("car-paint-midnight", partial(slid, edge_tint=(1.0, 0.25, 0.1), edge_strength=4.0)),
            ("car-paint-midnight", partial(slid, edge_strength=0.0)),
            ("satin-gold", partial(slid, specular_saturation=0.1)),
            ("satin-gold", partial(slid, specular_hue=2.4)),
        ],
    )


def controls_body(studio: Studio) -> list[list[np.ndarray]]:
    """What acts on the diffuse part, and the node."""
    return pairs(
        studio,
        [
            ("plastic-red", partial(slid, diffuse_saturation=0.3)),
            ("plastic-red", partial(slid, diffuse_hue=2.1)),
            ("plastic-red", partial(socket, studio, "Diffuse", (0.02, 0.2, 0.05, 1.0))),
            ("car-paint-copper", partial(socket, studio, "Lobe 2 Scale", (0.1, 0.5, 3.0, 1.0))),
        ],
    )


def controls_curves(studio: Studio) -> list[list[np.ndarray]]:
    """Curves, and a blend."""
    cut = {name: [point[:2] for point in CUT_OFF] for name in ("Lobe 2 D", "Lobe 3 D")}
    fall = [(0.0, 1.0), (0.3, 0.95), (0.55, 0.25), (1.0, 0.0)]
    falling = {f"Lobe {lobe} G": fall for lobe in (1, 2, 3)}
    rise = {"F": [(0.0, 0.01), (0.3, 0.03), (0.6, 0.5), (1.0, 1.0)]}
    velvet = studio.load("nfm_addon.demo.materials").entry("velvet-crimson")
    return pairs(
        studio,
        [
            ("car-paint-copper", partial(curves, studio, cut)),
            ("satin-copper", partial(curves, studio, falling)),
            ("satin-copper", partial(curves, studio, rise)),
            ("satin-copper", lambda material: blend(studio, material, velvet, 0.5)),
        ],
    )


def controls_direction(studio: Studio) -> list[list[np.ndarray]]:
    """What anisotropic materials have besides."""
    level = {f"Lobe {lobe} D around": [(0.0, 1.0), (1.0, 1.0)] for lobe in (1, 2, 3)}

    def level_around(material: object) -> None:
        curves(studio, level, material)
        slid(material, keep_energy=True)  # what was dark is as bright as the brightest

    every = {f"lobe_{lobe}_width": 1.0 for lobe in (1, 2, 3)}
    along = {f"{name}_along": 3.0 for name in every}
    across = {f"{name}_across": 0.4 for name in every}
    return pairs(
        studio,
        [
            ("brushed-brass", partial(socket, studio, "Rotation", 90.0)),
            ("brushed-brass", partial(slid, **along)),
            ("brushed-brass", partial(slid, **across)),
            ("brushed-brass", level_around),
        ],
    )


def controls_lobes_alone(studio: Studio) -> list[list[np.ndarray]]:
    """Mute, solo, Keep Energy and Show Original."""
    bright = partial(slid, lobe_1_gain=3.0, lobe_2_gain=3.0, lobe_3_gain=3.0)
    return pairs(
        studio,
        [
            ("car-paint-copper", partial(listen, "mute", 1)),
            ("car-paint-copper", partial(listen, "solo", 1)),
            ("satin-copper", partial(slid, keep_energy=True), bright),
            ("satin-gold", partial(slid, show_original=True), partial(slid, specular_hue=2.4)),
        ],
    )


def samplings(studio: Studio) -> list[list[np.ndarray]]:
    """Native, smooth, exact, reference and cosine sampling under a small lamp, few samples."""
    import bpy

    sphere = studio.load("nfm_addon.standard_sphere")
    material = studio.from_library("car-paint-copper")
    view = sphere.SphereView(resolution=LAMP_RESOLUTION, samples=LAMP_SAMPLES)
    scene = sphere.build_scene(material, view)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.15
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = LAMP_POWER, LAMP_RADIUS
    item = bpy.data.objects.new("Lamp", lamp)
    item.location = LAMP_PLACE
    scene.collection.objects.link(item)
    row = []
    for sampling in ("NATIVE", "SMOOTH", "EXACT", "REFERENCE", "COSINE"):
        material.nfm.sampling = sampling
        row.append(studio.render(scene))
    return [row]


def demo(studio: Studio) -> None:
    """demo.blend as it is, which closes whatever is open: the last one."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(CHECKOUT / "demo.blend"))
    scene = bpy.context.scene
    scene.render.dither_intensity = 0  # noise costs bytes
    scene.render.image_settings.compression = 100
    studio.load("nfm_addon.rendering").render_to_file(scene, IMAGES / "demo.png")


PICTURES: dict[str, Callable[[Studio], list[list[np.ndarray]] | None]] = {
    function.__name__: function
    for function in (
        standard_sphere,
        edits,
        controls_lobes,
        controls_colour,
        controls_body,
        controls_curves,
        controls_direction,
        controls_lobes_alone,
        samplings,
        demo,
    )
}


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
