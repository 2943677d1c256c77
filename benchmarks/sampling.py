# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of cosine against reference sampling at equal samples (Peng et al. 2017, fig. 2).

The standard sphere in Grace Cathedral, as ./nfm render makes it. Mean squared error over the
sphere's pixels, linear, against a converged picture (reference sampling, another seed). Both
samplings are run with the same numbers of candidates per shading point, and compared as
./nfm render runs them too.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from importlib import import_module
from pathlib import Path

import numpy as np

from runner.blender import load_extension

from . import shared_data

MATERIALS = ("red-metallic-paint", "red-specular-plastic", "black-obsidian")
TARGET = 32
CANDIDATES = (1, 2, 4, 8)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench sampling."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(MATERIALS))
    parser.add_argument("--resolution", type=int, default=96)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--converged-samples", type=int, default=8192)
    parser.add_argument("--seeds", type=int, default=4)


def run(arguments: argparse.Namespace) -> int:
    """Render, compare and print; returns 1 if a ratio with the defaults is below the target."""
    shared_data.require_shared()
    addon = load_extension().__name__ + ".nfm_addon"
    material = import_module(f"{addon}.material")
    defaults = import_module(f"{addon.removesuffix('.nfm_addon')}.osl.generate").DEFAULT_CANDIDATES
    print(
        f"{'material':<24}{'candidates':>11}{'MSE reference':>15}{'MSE cosine':>12}{'ratio':>8}"
        f"{'s ref':>8}{'s cos':>8}{'efficiency':>12}"
    )
    missed = 0
    for name in arguments.materials.split(","):
        fitted = shared_data.fitted_material(name, None)
        render = Renderer(addon, arguments.resolution)
        surface = {s: material.build(fitted, s.upper()) for s in ("reference", "cosine")}
        converged = render(surface["reference"], arguments.converged_samples, seed=1000)
        mse, seconds = {}, {}
        for candidates in CANDIDATES:
            for sampling, new in surface.items():
                socket = material.find_script_node(new).inputs["Candidates"]
                socket.default_value = candidates
                start = time.perf_counter()
                render(new, 1, seed=0)
                overhead = time.perf_counter() - start
                start = time.perf_counter()
                errors = [
                    np.mean((render(new, arguments.samples, seed) - converged) ** 2)
                    for seed in range(arguments.seeds)
                ]
                key = sampling, candidates
                seconds[key] = (time.perf_counter() - start) / arguments.seeds - overhead
                mse[key] = float(np.mean(errors))
            ours, theirs = ("reference", candidates), ("cosine", candidates)
            first = "reference", CANDIDATES[0]
            efficiency = mse[first] * seconds[first] / (mse[ours] * seconds[ours])
            print(
                f"{name:<24}{candidates:>11}{mse[ours]:15.3e}{mse[theirs]:12.3e}"
                f"{mse[theirs] / mse[ours]:8.0f}{seconds[ours]:8.1f}{seconds[theirs]:8.1f}"
                f"{efficiency:12.2f}",
                flush=True,
            )
        ratio = mse["cosine", defaults["cosine"]] / mse["reference", defaults["reference"]]
        missed += ratio < TARGET
        print(f"{name:<24}    default{'':27}{ratio:8.0f}  (target: at least {TARGET})", flush=True)
    print("s: seconds of a picture less those of a picture with one sample (building the scene)")
    print(f"efficiency: 1 / (MSE x seconds) of reference, relative to {CANDIDATES[0]} candidate")
    print(f"default: {defaults} candidates, as ./nfm render")
    return 1 if missed else 0


class Renderer:
    """Renders the standard sphere in Grace to pixels (n, 3) of the sphere's inside."""

    def __init__(self, addon: str, resolution: int) -> None:
        self._sphere = import_module(f"{addon}.standard_sphere")
        self._rendering = import_module(f"{addon}.rendering")
        self._images = import_module(f"{addon}.images")
        self._resolution = resolution
        axis = ((np.arange(resolution) + 0.5) / resolution - 0.5) * self._sphere.CAMERA_WIDTH
        self._inside = np.hypot(axis[:, None], axis[None, :]) < 0.98

    def __call__(self, material: object, samples: int, seed: int) -> np.ndarray:
        """Linear pixels (n, 3)."""
        view = self._sphere.SphereView(
            resolution=self._resolution,
            samples=samples,
            seed=seed,
            environment=shared_data.GRACE,
        )
        scene = self._sphere.build_scene(material, view)
        with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
            picture = Path(folder, "picture.exr")
            self._rendering.render_to_file(scene, picture)
            self._rendering.remove_scene(scene)
            return self._images.read_linear(picture)[self._inside].astype(np.float64)
