# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether exact sampling is unbiased: its mean against reference sampling and against numpy.

The standard sphere under three lights that reference sampling can resolve: uniform white, the soft
boxes of the demo, and a square lamp of 3 m. Means over whole blocks of the picture inside the
sphere; errors are standard errors over the seeds.
"""

from __future__ import annotations

import argparse
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np

from runner.blender import load_extension

from . import shared_data
from .expected import expected_picture
from .lights import Light
from .render import Stage

MATERIALS = (
    *("aluminium", "nickel", "black-obsidian", "violet-acrylic", "red-specular-plastic"),
    *("silver-metallic-paint", "red-metallic-paint", "polyurethane-foam", "pink-fabric"),
    "blue-rubber",
)
LIMIT = 0.003
SEEDS = 4
NUMPY_POINTS = 8192


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench exact."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(MATERIALS))
    parser.add_argument("--fits", metavar="DIR", type=Path, help="keeps fits, and uses them")
    parser.add_argument("--resolution", type=int, default=32, metavar="R")
    parser.add_argument("--samples", type=int, default=512, metavar="N", help="of each seed")
    parser.set_defaults(ground=False)


def run(arguments: argparse.Namespace) -> int:
    """Print a line for each material and light; returns 1 if a mean is off by more than LIMIT.

    A difference within three standard errors is no failure: it is not known to be one.
    """
    shared_data.require_shared()
    addon = f"{load_extension().__name__}.nfm_addon"
    material = import_module(f"{addon}.material")
    missed = 0
    print(f"{'material':<24}{'light':<10}{'exact / reference - 1':>26}{'exact / numpy - 1':>26}")
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        stages = [Stage(addon, light, arguments) for light in _lights(addon, Path(folder))]
        for name in arguments.materials.split(","):
            fitted = shared_data.fitted_material(name, arguments.fits)
            surfaces = {s: material.build(fitted, s.upper()) for s in ("exact", "reference")}
            for stage in stages:
                mean, error = {}, {}
                for sampling, surface in surfaces.items():
                    # reference is noisier and has to be as sure
                    samples = arguments.samples * (4 if sampling == "reference" else 1)
                    values = [
                        stage.block_means(stage.render(surface, samples, seed)[0]).mean()
                        for seed in range(SEEDS)
                    ]
                    mean[sampling] = np.mean(values)
                    error[sampling] = np.std(values, ddof=1) / np.sqrt(SEEDS)
                halves = [
                    expected_picture(
                        fitted.model, stage.source, stage.blocks, NUMPY_POINTS, rng
                    ).mean()
                    for rng in np.random.default_rng(0).spawn(2)
                ]
                mean["numpy"] = np.mean(halves)
                error["numpy"] = np.std(halves, ddof=1) / np.sqrt(2)
                line = f"{name:<24}{stage.light.name:<10}"
                for other in ("reference", "numpy"):
                    off = mean["exact"] / mean[other] - 1
                    sigma = np.hypot(error["exact"], error[other]) / mean[other]
                    missed += abs(off) > LIMIT + 3 * sigma
                    line += f"{off:+15.3%} +- {sigma:6.3%}"
                print(line, flush=True)
    print(f"{missed} means are off by more than {LIMIT:.1%} and three standard errors")
    return 1 if missed else 0


def _lights(addon: str, folder: Path) -> list[Light]:
    images = import_module(f"{addon}.images")
    studio = import_module(f"{addon}.demo_light").studio()
    maps = {"white": np.ones_like(studio), "boxes": studio}
    for name, pixels in maps.items():
        images.write_linear(folder / f"{name}.exr", pixels)
    lights = [Light(name, name, environment=folder / f"{name}.exr") for name in maps]
    return [*lights, Light("area", "3 m area lamp", lamp="area", size=3.0)]
