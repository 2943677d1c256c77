# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of the shared RGL files against the files, in numpy and against Mitsuba's renders.

The files are not reciprocal and the model is: a fit is graded against the mean of both directions
of each pair, and against the look-up of renderers, with the viewer as the measurement's incident
direction. Two grades:

- numpy: noise-free spheres in Grace and Grove, measured_sphere.py;
- Cycles: the fit in native and in exact sampling against Mitsuba's render of the original file
  with its plugin `measured`, the same sphere, camera and map in both, pixels inside the sphere.
  Every picture is the mean of two with other seeds; its noise is the PSNR of these two, less what
  the mean gains (6 dB).

PSNR as fitter/pictures/sphere.py: exposure by the reference, gamma 2.2, peak 1. What is done is
kept.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np

from fitter.errors import NfmError
from fitter.fitting.quality import DEFAULT_QUALITY, QUALITIES
from fitter.formats import parameter_file, readers, rgl
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs import fit_file
from fitter.pictures.sphere import LitScene, rendered_psnr, sphere_normals
from runner.blender import load_extension

from . import measured_sphere, mitsuba_sphere, rgl_report, shared_data

SAMPLINGS = ("native", "exact")
INSIDE = 0.95  # of the radius: the rim's pixels are half background
SEEDS = (0, 1)

# Mitsuba's picture is what the others are compared with, and quicker: so many times the samples.
REFERENCE_FACTOR = 4


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench rgl."""
    parser.add_argument("--materials", metavar="A,B", help="default: all")
    parser.add_argument(
        "--keep", metavar="DIR", type=Path, required=True, help="fits, pictures and figures"
    )
    parser.add_argument("--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY)
    parser.add_argument("--resolution", type=int, default=64, metavar="R")
    parser.add_argument(
        "--every", type=int, default=1, metavar="N", help="numpy grades every Nth pixel only"
    )
    parser.add_argument(
        "--samples", type=int, default=128, metavar="N", help="of a render, both seeds together"
    )
    parser.add_argument("--no-renders", action="store_true", help="the grades of numpy alone")
    parser.add_argument(
        "--picture", metavar="FILE", type=Path, help="write a sheet of spheres here"
    )
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="and the table for docs/")


def run(arguments: argparse.Namespace) -> int:
    """Fit, grade and print; returns 1 if a target is missed."""
    shared_data.require_shared()
    names = shared_data.rgl_names()
    if arguments.materials:
        names = arguments.materials.split(",")
    arguments.keep.mkdir(parents=True, exist_ok=True)
    addon = f"{load_extension().__name__}.nfm_addon"
    read_linear = import_module(f"{addon}.images").read_linear
    maps = [read_linear(path) for path in shared_data.MAPS.values()]
    normals, mask = sphere_normals(arguments.resolution)
    scene = LitScene(normals[:: arguments.every], mask, maps)
    rows = []
    for name in names:
        fitted = _fitted(name, arguments.keep, arguments.quality)
        row = kept(arguments.keep / f"{name}.json", partial(_graded, name, fitted, scene))
        if not arguments.no_renders:
            pictures = _rendered(addon, name, fitted, arguments)
            row |= render_grades(pictures, arguments.resolution)
        rows.append({"material": name, "fit": fitted.fit, **row})
        print(rgl_report.line(rows[-1]), flush=True)
    checks = rgl_report.checks(rows)
    print("\n".join(rgl_report.summary(rows, checks)))
    if arguments.picture:
        shown = {name: _rendered(addon, name, None, arguments) for name in names}
        write = import_module(f"{addon}.images").write_picture
        write(arguments.picture, rgl_report.sheet(shown))
    if arguments.markdown:
        text = rgl_report.markdown(rows, checks, arguments.samples)
        arguments.markdown.write_text(text, encoding="utf-8")
    return 1 if any(not check.ok for check in checks) else 0


def _fitted(name: str, folder: Path, quality: str) -> FittedMaterial:
    path = folder / f"{name}{parameter_file.SUFFIX}"
    if path.is_file():
        return parameter_file.load(path)
    start = time.process_time()
    measurement = readers.read(shared_data.rgl_path(name))
    fitted = fit_file.fit_measurement(measurement, quality=quality)
    fitted.fit["cpu_seconds"] = round(time.process_time() - start, 1)
    parameter_file.save(path, fitted)
    return fitted


def kept(path: Path, work: Callable[[], dict]) -> dict:
    """What an earlier run wrote to this JSON file, or the result of the work."""
    if not path.is_file():
        path.write_text(json.dumps(work()), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def _graded(name: str, fitted: FittedMaterial, scene: LitScene) -> dict[str, list[float]]:
    """PSNR in dB for each map: of the fit and of the look-up of renderers."""
    file = rgl.load(shared_data.rgl_path(name)).brdf

    def forward(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.maximum(file.f_r(wi, wo), 0)

    def renderers(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.maximum(file.f_r(wo, wi), 0)

    brdfs = [forward, renderers, fitted.model.f_r]
    direct, one_sided, fit = measured_sphere.render(scene, file, brdfs)
    mean = (direct + one_sided) / 2
    return {
        "fit_mean": rendered_psnr(fit, mean).tolist(),
        "fit_one_sided": rendered_psnr(fit, one_sided).tolist(),
        "one_sided_mean": rendered_psnr(one_sided, mean).tolist(),
    }


def _rendered(
    addon: str, name: str, fitted: FittedMaterial | None, arguments: argparse.Namespace
) -> dict[str, np.ndarray]:
    """Pictures (maps, seeds, height, width, 3) by "mitsuba" and the names of samplings.

    fitted : not needed where the pictures were kept
    """
    samples, size = arguments.samples // len(SEEDS), arguments.resolution

    def original() -> dict[str, list]:
        bsdf = {"type": "measured", "filename": str(shared_data.rgl_path(name))}
        number = REFERENCE_FACTOR * samples
        return {
            "mitsuba": [
                [mitsuba_sphere.render(bsdf, light, size, number, seed) for seed in SEEDS]
                for light in shared_data.MAPS.values()
            ]
        }

    def fits() -> dict[str, list]:
        if fitted is None:
            raise NfmError(f"{name}: its pictures are not there; render them first")
        # as Blender's own copy of the package knows it
        loads = import_module(
            ".fitter.formats.parameter_file", addon.removesuffix(".nfm_addon")
        ).loads
        material = loads(parameter_file.dumps(fitted))
        pictures = {}
        for sampling in SAMPLINGS:
            surface = import_module(f"{addon}.material").build(material, sampling.upper())
            pictures[sampling] = [
                [_cycles(addon, surface, light, size, samples, seed) for seed in SEEDS]
                for light in shared_data.MAPS.values()
            ]
        return pictures

    # Mitsuba's do not depend on the fit
    return {
        **_kept_pictures(arguments.keep / f"{name}.mitsuba.npz", original),
        **_kept_pictures(arguments.keep / f"{name}.npz", fits),
    }


def _kept_pictures(path: Path, work: Callable[[], dict[str, list]]) -> dict[str, np.ndarray]:
    if not path.is_file():
        np.savez_compressed(path, **{k: np.array(v, np.float32) for k, v in work().items()})
    with np.load(path, allow_pickle=False) as pictures:
        return dict(pictures)


def _cycles(
    addon: str, surface: object, light: Path, size: int, samples: int, seed: int
) -> np.ndarray:
    sphere = import_module(f"{addon}.standard_sphere")
    rendering = import_module(f"{addon}.rendering")
    view = sphere.SphereView(resolution=size, samples=samples, seed=seed, environment=light)
    scene = sphere.build_scene(surface, view)
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        picture = Path(folder, "picture.exr")
        rendering.render_to_file(scene, picture)
        rendering.remove_scene(scene)
        return import_module(f"{addon}.images").read_linear(picture)


def render_grades(pictures: dict[str, np.ndarray], size: int) -> dict[str, list[float]]:
    """PSNR of each sampling against Mitsuba, and the noise of each picture, in dB for each map."""
    axis = ((np.arange(size) + 0.5) / size - 0.5) * mitsuba_sphere.CAMERA_WIDTH
    inside = np.hypot(axis[:, None], axis[None, :]) < INSIDE
    pixels = {key: np.maximum(images[:, :, inside], 0) for key, images in pictures.items()}
    means = {key: both.mean(1) for key, both in pixels.items()}
    grades = {
        sampling: rendered_psnr(means[sampling], means["mitsuba"]).tolist()
        for sampling in SAMPLINGS
    }
    gained = 20 * np.log10(len(SEEDS))
    for key, both in pixels.items():
        grades[f"{key}_noise"] = (rendered_psnr(both[:, 0], both[:, 1]) + gained).tolist()
    return grades
