# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise, speed and error of every sampling in Cycles, beside a matched Principled BSDF.

The standard sphere (with --ground above a grey plane) under five lights. Every sampling of the
add-on and the Principled BSDF that principled_node.py matches to the material render the same scene
with the same samples; noise.py says what is made of the pictures. Pixels are those inside the
sphere. Seconds are CPU seconds on one thread, less those of a picture with one sample, from all
pictures of a sampling, for a picture of --samples. The error is that of the mean of all pictures
against an integral in numpy (expected.py), over blocks of about 1/32 of the picture's width.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import asdict
from importlib import import_module
from pathlib import Path

import numpy as np

from fitter.errors import NfmError
from fitter.formats import parameter_file
from runner.blender import load_extension

from . import principled_node, render_report, shared_data
from .expected import Blocks, expected_picture, source_of
from .lights import LIGHTS, Light, add_lamp
from .picture_noise import image_error, noise_of

PRINCIPLED = render_report.PRINCIPLED
CONVERGED_SEED = 1000
BLOCKS_ACROSS = 32
INSIDE = 0.98  # of the radius; the rim is half background
DISPLAY_MEAN = 0.3

FULL = {"resolution": 64, "samples": 64, "seeds": 4, "converged_samples": 384, "points": 8192}
QUICK = {"resolution": 40, "samples": 64, "seeds": 2, "converged_samples": 128, "points": 2048}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench render."""
    default = ",".join(name for names in render_report.MATERIALS.values() for name in names)
    parser.add_argument("--materials", metavar="A,B", help=f"default: {default}")
    parser.add_argument("--samplings", metavar="A,B", help="default: all of the add-on")
    parser.add_argument("--lights", metavar="A,B", default=",".join(LIGHTS))
    parser.add_argument("--resolution", type=int, metavar="R", help=_default("resolution"))
    parser.add_argument("--samples", type=int, metavar="N", help=_default("samples"))
    parser.add_argument("--seeds", type=int, metavar="N", help=_default("seeds"))
    parser.add_argument(
        "--converged-samples", type=int, metavar="N", help=_default("converged_samples")
    )
    parser.add_argument(
        "--points", type=int, metavar="N", help=f"of a block's integral; {_default('points')}"
    )
    parser.add_argument(
        "--ground", action="store_true", help="a grey plane below; the error is left out"
    )
    parser.add_argument("--quick", action="store_true", help="one material per class, less of all")
    parser.add_argument(
        "--fits", metavar="DIR", type=Path, help="keep fits here and use them again"
    )
    parser.add_argument("--pictures", metavar="DIR", type=Path, help="write PNGs here")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here as well")
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="and as tables for docs/")


def run(arguments: argparse.Namespace) -> int:
    """Render, compare and print; returns 1 if a target is missed."""
    shared_data.require_shared()
    for name, value in (QUICK if arguments.quick else FULL).items():
        if getattr(arguments, name) is None:
            setattr(arguments, name, value)
    addon = f"{load_extension().__name__}.nfm_addon"
    known = [item[0].lower() for item in import_module(f"{addon}.properties").SAMPLING_ITEMS]
    samplings = _chosen(arguments.samplings, known, "sampling")
    lights = [LIGHTS[name] for name in _chosen(arguments.lights, list(LIGHTS), "light")]
    names = [n for group in render_report.MATERIALS.values() for n in group[: 2 - arguments.quick]]
    if arguments.materials:
        known = [*shared_data.material_names(), *shared_data.anisotropic_names()]
        names = _chosen(arguments.materials, known, "material")
    for folder in (arguments.fits, arguments.pictures):
        if folder:
            folder.mkdir(parents=True, exist_ok=True)

    stages = {light.name: Stage(addon, light, arguments) for light in lights}
    start = time.perf_counter()
    rows, matches = [], {}
    for name in names:
        fitted = shared_data.fitted_material(name, arguments.fits)
        matched = principled_node.match(
            fitted.model.f_r,
            metal=render_report.class_of(name) == "metal",
            directed=fitted.model.kind == "anisotropic",
        )
        matches[name] = asdict(matched)
        print(f"\n{name} ({render_report.class_of(name)}): Principled {_described(matched)}")
        print(render_report.HEADER)
        build = import_module(f"{addon}.material").build
        surfaces = {PRINCIPLED: principled_node.build(matched)}
        surfaces |= {sampling: build(fitted, sampling.upper()) for sampling in samplings}
        for light in lights:
            rows += _compare(stages[light.name], name, fitted, surfaces, arguments)
    title = _settings(arguments, time.perf_counter() - start)
    print(f"\n{render_report.LEGEND}\n\n{title}\n")
    checks = render_report.checks(rows)
    lines = [*render_report.summary_lines(rows), "", *render_report.check_lines(checks)]
    print("\n".join(lines))
    if arguments.json:
        arguments.json.write_text(json.dumps({"rows": rows, "matches": matches}, indent=1))
    if arguments.markdown:
        text = render_report.markdown(rows, matches, checks, title)
        arguments.markdown.write_text(text, encoding="utf-8")
    return 1 if any(check.ok is False for check in checks) else 0


def _compare(
    stage: Stage,
    name: str,
    fitted: parameter_file.FittedMaterial,
    surfaces: dict[str, object],
    arguments: argparse.Namespace,
) -> list[dict]:
    """Rows of one material under one light, Principled first; prints each."""
    truths = tuple(
        expected_picture(
            fitted.model,
            stage.source,
            stage.blocks,
            # a lamp is an integral over little more than the block: as exact with a quarter
            arguments.points if stage.light.environment else max(arguments.points // 4, 1),
            np.random.default_rng(seed),
        )
        for seed in (1, 2)
    )
    rows, shown = [], []
    for sampling, surface in surfaces.items():
        first = min(stage.render(surface, 1, seed)[1] for seed in (0, 1))
        count = arguments.converged_samples
        converged, seconds = stage.render(surface, count, CONVERGED_SEED)
        pictures = []
        for seed in range(arguments.seeds):
            picture, spent = stage.render(surface, arguments.samples, seed)
            pictures.append(picture)
            seconds += spent
        timed = count - 1 + arguments.seeds * (arguments.samples - 1)
        inside = np.array([picture[stage.inside] for picture in pictures])
        noise = noise_of(inside, converged[stage.inside], arguments.samples, count)
        row = {
            "material": name,
            "class": render_report.class_of(name),
            "light": stage.light.name,
            "sampling": sampling,
            **asdict(noise),
            "seconds": (seconds - first * (1 + arguments.seeds)) / timed * arguments.samples,
        }
        if sampling != PRINCIPLED:
            halves = stage.block_means(np.mean(pictures, axis=0)), stage.block_means(converged)
            row["mean_error"] = float(
                (halves[0].mean() + halves[1].mean()) / (truths[0].mean() + truths[1].mean()) - 1
            )
            if not arguments.ground:  # whose light the truth has not
                row["error"] = image_error(halves, truths)
        rows.append(row)
        render_report.add_ratios(row, rows[0])
        print(render_report.row_line(row), flush=True)
        shown.append((pictures[0], converged))
    if arguments.pictures:
        path = arguments.pictures / f"{name}-{stage.light.name}.png"
        stage.images.write_picture(path, _contact_sheet(shown))
    return rows


class Stage:
    """The sphere under one light; renders any material on it.

    images : the add-on's module of that name
    inside : (resolution, resolution) pixels of the sphere
    source, blocks : the same light and picture for expected.py
    """

    def __init__(self, addon: str, light: Light, arguments: argparse.Namespace) -> None:
        import bpy

        self.light = light
        self._rendering = import_module(f"{addon}.rendering")
        self.images = import_module(f"{addon}.images")
        sphere = import_module(f"{addon}.standard_sphere")
        view = sphere.SphereView(resolution=arguments.resolution, environment=light.environment)
        self._scene = sphere.build_scene(bpy.data.materials.new("placeholder"), view)
        self._sphere = next(item for item in self._scene.objects if item.type == "MESH")
        self._scene.render.threads_mode, self._scene.render.threads = "FIXED", 1
        self._scene.render.use_persistent_data = True
        if light.lamp:
            for node in self._scene.world.node_tree.nodes:
                if node.type == "BACKGROUND":
                    node.inputs["Strength"].default_value = 0
            add_lamp(self._scene, light)
        if arguments.ground:
            _add_ground(self._scene)

        size, width = arguments.resolution, sphere.CAMERA_WIDTH
        axis = ((np.arange(size) + 0.5) / size - 0.5) * width
        self.inside = np.hypot(axis[:, None], axis[None, :]) < INSIDE
        self._pixels = max(size // BLOCKS_ACROSS, 1)
        across = size // self._pixels
        side = width / size * self._pixels
        middle = (np.arange(across) + 0.5) * side - width / 2
        x, z = np.meshgrid(middle, -middle)
        self._whole = np.hypot(np.abs(x) + side / 2, np.abs(z) + side / 2) < INSIDE
        self.blocks = Blocks(x[self._whole], z[self._whole], side)
        image = self.images.read_linear(light.environment) if light.environment else None
        self.source = source_of(light, image)

    def render(self, material: object, samples: int, seed: int) -> tuple[np.ndarray, float]:
        """Linear pixels (resolution, resolution, 3) and CPU seconds."""
        material.cycles.use_bump_map_correction = False  # as standard_sphere.py
        self._sphere.data.materials[0] = material
        self._scene.cycles.samples, self._scene.cycles.seed = samples, seed
        with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
            picture = Path(folder, "picture.exr")
            start = time.process_time()
            self._rendering.render_to_file(self._scene, picture)
            seconds = time.process_time() - start
            return self.images.read_linear(picture).astype(np.float64), seconds

    def block_means(self, picture: np.ndarray) -> np.ndarray:
        """Means (n, 3) of a picture over the blocks."""
        across, size = len(self._whole), self._pixels
        cropped = picture[: across * size, : across * size]
        return cropped.reshape(across, size, across, size, 3).mean((1, 3))[self._whole]


def _add_ground(scene: object) -> None:
    """A grey plane of 8 x 8 m that the sphere stands on."""
    import bpy

    mesh = bpy.data.meshes.new("Ground")
    corners = [(-4, -4, -1), (4, -4, -1), (4, 4, -1), (-4, 4, -1)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    grey = principled_node.Inputs(0.0, 1.0, (0.5,) * 3, 1.0, (1.0,) * 3, 0.0)
    mesh.materials.append(principled_node.build(grey))
    scene.collection.objects.link(bpy.data.objects.new("Ground", mesh))


def _contact_sheet(shown: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Upper row one seed, lower row converged; each column exposed by its converged mean."""
    columns = [np.concatenate(pair) * (DISPLAY_MEAN / max(pair[1].mean(), 1e-6)) for pair in shown]
    return np.concatenate(columns, axis=1)


def _chosen(text: str | None, known: list[str], what: str) -> list[str]:
    if not text:
        return known
    chosen = text.split(",")
    for name in chosen:
        if name not in known:
            raise NfmError(f"there is no {what} {name!r}; use some of {', '.join(known)}")
    return chosen


def _described(matched: principled_node.Inputs) -> str:
    if matched.metallic:
        look = f"metallic, F0 {np.mean(matched.base_color):.3f}"
    else:
        f0 = ((matched.ior - 1) / (matched.ior + 1)) ** 2
        look = f"base {np.mean(matched.base_color):.3f}, F0 {f0:.3f}"
    return f"roughness {matched.roughness:.3f}, {look}, error of the match {matched.error:.2f}"


def _settings(arguments: argparse.Namespace, seconds: float) -> str:
    return (
        f"{'Quick run: ' * arguments.quick}"
        f"{arguments.resolution} x {arguments.resolution} pixels, {arguments.samples} samples, "
        f"{arguments.seeds} seeds, converged: {arguments.converged_samples} samples and the other "
        f"seeds{', with a ground plane' * arguments.ground}; {seconds / 60:.0f} minutes in all"
    )


def _default(name: str) -> str:
    return f"default: {FULL[name]}, quick {QUICK[name]}"
