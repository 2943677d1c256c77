# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of the base lobes, which are what native sampling shows, against the model.

Pictures of a sphere under a map without noise (fitter/shading/base_error.py), the map box-filtered
to 256 x 128. Fits are made once and kept with --fits.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from fitter.pictures.sphere import box_filtered
from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import fit_base_lobes

from . import shared_data
from .expected import Environment
from .fit import environment_maps

LIMIT, METAL_LIMIT, LEAST_PSNR = 0.01, 0.02, 40.0
METALS = (
    *("brushed-metal", "anodised"),
    *("aluminium", "aventurnine", "black-oxidized-steel", "brass", "chrome-steel", "gold-paint"),
    *("hematite", "nickel", "silver-paint", "ss440", "steel", "two-layer-gold"),
    *("color-changing-paint1", "color-changing-paint3"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench base."""
    parser.add_argument("--materials", metavar="A,B", help="default: all shared ones")
    parser.add_argument(
        "--anisotropic", action="store_true", help="the synthetic anisotropic materials instead"
    )
    parser.add_argument("--fits", metavar="DIR", type=Path, help="keeps fits, and uses them")
    parser.add_argument("--markdown", metavar="FILE", type=Path)


def run(arguments: argparse.Namespace) -> int:
    """Print a line for each material; returns 1 if a target is missed."""
    shared_data.require_shared()
    names = (arguments.materials or "").split(",") if arguments.materials else None
    lights = [map_light(image) for image in environment_maps()]
    rows = []
    print(f"{'material':<28}{'base s':>7}{'all dir.':>10}{'L1 Grace/Grove':>18}{'PSNR':>12}")
    every = (
        shared_data.anisotropic_names() if arguments.anisotropic else shared_data.material_names()
    )
    for name in names or every:
        model = shared_data.fitted_material(name, arguments.fits).model
        start = time.process_time()
        base = fit_base_lobes(model)
        seconds = time.process_time() - start
        errors = [base_error(model, base, light) for light in lights]
        row = (
            name,
            seconds,
            errors[0].directional,
            [error.image for error in errors],
            [error.psnr for error in errors],
        )
        rows.append(row)
        print(
            f"{name:<28}{seconds:7.2f}{row[2]:10.2%}{row[3][0]:11.2%}{row[3][1]:7.2%}"
            f"{row[4][0]:7.1f}{row[4][1]:5.1f}",
            flush=True,
        )
    if arguments.markdown:
        arguments.markdown.write_text(_markdown(rows, arguments), encoding="utf-8")
    return _summary(rows)


def is_metallic(name: str) -> bool:
    """Metals and metallic paints, which have the wider limit."""
    return "metallic" in name or name in METALS


def map_light(image: np.ndarray) -> object:
    """Radiance (n, 3) of a map (h, w, 3) towards directions (n, 3), box-filtered to 256 x 128."""
    environment = Environment(box_filtered(image, 128, 256))

    def radiance(directions: np.ndarray) -> np.ndarray:
        return environment.radiance(directions, directions)

    return radiance


def _summary(rows: list[tuple]) -> int:
    missed = 0
    psnr = np.array([row[4] for row in rows])
    print(
        f"\nmean of {len(rows)}: all directions {np.mean([r[2] for r in rows]):.2%}, image L1 "
        f"{np.mean([r[3] for r in rows]):.2%}, PSNR {psnr.mean():.1f} dB, smallest {psnr.min():.1f}"
    )
    missed += psnr.mean() < LEAST_PSNR
    for metallic, limit in ((False, LIMIT), (True, METAL_LIMIT)):
        group = {row[0]: np.mean(row[3]) for row in rows if is_metallic(row[0]) == metallic}
        over = [name for name, error in group.items() if error > limit]
        kind = "metals and metallic paints" if metallic else "others"
        print(f"{kind}: {len(group) - len(over)} of {len(group)} within {limit:.0%}", *over)
        missed += len(over)
    return 1 if missed else 0


def _markdown(rows: list[tuple], arguments: argparse.Namespace) -> str:
    option = "--anisotropic " * arguments.anisotropic
    which = "synthetic anisotropic" if arguments.anisotropic else "shared"
    lines = [
        f"# Base lobes of the {which} materials",
        "",
        f"Written by `./nfm bench base {option}--markdown {arguments.markdown.as_posix()}`; see",
        "[RESULTS.md](../RESULTS.md). Error of native sampling against the fitted model.",
        "",
        "| material | seconds | all directions | image L1 Grace | Grove | PSNR Grace | Grove |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {name} | {seconds:.2f} | {directional:.2%} | {image[0]:.2%} | {image[1]:.2%} "
        f"| {psnr[0]:.1f} | {psnr[1]:.1f} |"
        for name, seconds, directional, image, psnr in rows
    ]
    return "\n".join(lines) + "\n"
