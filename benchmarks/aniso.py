# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of synthetic anisotropic materials, graded over the data and by pictures.

The materials are closed formulas written as UTIA files with lognormal noise and negative values;
nothing was measured. Pictures (fitter/pictures/framed_scene.py) are a sphere, whose tangent is the
direction of increasing longitude, and a hanging cloth, both in Grove. They are graded against two
references: the table as read from the file, interpolated linearly in all four angles and constant
beyond 75 degrees, and the formula without noise.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

import numpy as np

from fitter.fitting.quality import ANISOTROPIC_QUALITIES, DEFAULT_QUALITY
from fitter.formats import parameter_file, readers
from fitter.grading.anisotropic_metrics import tabulate
from fitter.grading.metrics import numeric_psnr
from fitter.pictures.framed_scene import FramedScene, cloth_scene, sphere_scene
from fitter.pictures.sphere import RESOLUTION, rendered_psnr

from . import planted, shared_data
from .fit import PLANTED, environment_maps, timed_fit

# dB: mean over the data, mean of the pictures on the sphere, worst picture, planted model.
TARGETS = {"numeric": 35.0, "rendered": 42.0, "worst": 34.0, "planted": 50.0}
REFERENCES = ("table", "exact")
HEADER = (
    "material",
    "CPU s",
    "MB",
    "objective",
    "albedo",
    "direction",
    "numeric",
    "sphere, table",
    "sphere, exact",
    "cloth, table",
    "cloth, exact",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench aniso."""
    parser.add_argument("--materials", metavar="A,B", help="default: all and a planted model")
    parser.add_argument(
        "--noise",
        type=float,
        default=shared_data.ANISOTROPIC_NOISE,
        help="standard deviation of the noise",
    )
    parser.add_argument(
        "--negatives",
        type=float,
        default=shared_data.ANISOTROPIC_NEGATIVES,
        help="share of negative values",
    )
    parser.add_argument("--quality", choices=list(ANISOTROPIC_QUALITIES), default=DEFAULT_QUALITY)
    parser.add_argument("--resolution", type=int, default=RESOLUTION, help="of the pictures")
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="write the table for docs/")


def run(arguments: argparse.Namespace) -> int:
    """Fit, grade and print the table; returns 1 if a target is missed."""
    shared_data.require_shared()
    names = [*shared_data.anisotropic_names(), PLANTED]
    if arguments.materials:
        names = arguments.materials.split(",")
    _, grove = environment_maps()
    scenes = [make([grove], arguments.resolution) for make in (sphere_scene, cloth_scene)]
    print(" | ".join(HEADER))
    rows = []
    for name in names:
        rows.append(grade(name, arguments, scenes))
        print(" | ".join(cells(rows[-1])), flush=True)
    if arguments.markdown:
        arguments.markdown.write_text(markdown_table(rows, arguments), encoding="utf-8")
    return print_summary(rows)


def grade(name: str, arguments: argparse.Namespace, scenes: list[FramedScene]) -> dict:
    """Write one material, fit it with ./nfm fit and return its figures."""
    tool = shared_data.anisotropic_materials()
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        measured, fitted = Path(folder, "measured.bin"), Path(folder, "fitted.nfm.json")
        if name == PLANTED:
            planted.write_anisotropic(measured)
            exact = planted.anisotropic_model().f_r
        else:
            shared_data.write_anisotropic(name, measured, arguments.noise, arguments.negatives)

            def exact(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
                return tool.evaluate(name, wi, wo)

        row = {
            "material": name,
            **timed_fit(measured, fitted, ["--quality", arguments.quality]),
        }
        measurement = readers.read(measured)
        model = parameter_file.load(fitted).model
    row["numeric"] = numeric_psnr(tabulate(model), measurement)
    for scene_name, scene in zip(("sphere", "cloth"), scenes, strict=True):
        picture = scene.render(model.f_r)
        for reference_name, f_r in zip(REFERENCES, (measurement.lookup, exact), strict=True):
            psnr = rendered_psnr(picture, scene.render(f_r))
            row[f"{scene_name}, {reference_name}"] = float(psnr[0])
    return row


def cells(row: dict) -> list[str]:
    """A row as text, in the order of HEADER."""
    return [
        row["material"],
        f"{row['cpu_seconds']:.1f}",
        f"{row['megabytes']:.0f}",
        f"{row['objective']:.2e}",
        f"{row['largest_directional_albedo']:.3f}",
        f"{row['anisotropy_direction']:.1f}",
        *(f"{row[key]:.1f}" for key in HEADER[6:]),
    ]


def markdown_table(rows: list[dict], arguments: argparse.Namespace) -> str:
    """The rows as docs/results/aniso.md shows them."""
    lines = [
        "# Fits of synthetic anisotropic materials",
        "",
        f"Written by `./nfm bench aniso --noise {arguments.noise} --negatives "
        f"{arguments.negatives} --quality {arguments.quality} --resolution "
        f"{arguments.resolution}`; what the columns mean is in",
        "[RESULTS.md](../RESULTS.md). Nothing here was measured. PSNR in dB.",
        "",
        "| " + " | ".join(HEADER) + " |",
        "|---|" + "---:|" * (len(HEADER) - 1),
        *("| " + " | ".join(cells(row)) + " |" for row in rows),
    ]
    return "\n".join(lines) + "\n"


def print_summary(rows: list[dict]) -> int:
    """Means against the targets; 1 if one is missed."""
    found: dict[str, float] = {}
    synthetic = [row for row in rows if row["material"] != PLANTED]
    if synthetic:
        found["numeric"] = statistics.mean(row["numeric"] for row in synthetic)
        for reference in REFERENCES:
            pictures = [row[f"sphere, {reference}"] for row in synthetic]
            found[f"rendered, {reference}"] = statistics.mean(pictures)
        keys = [key for key in HEADER if "sphere" in key or "cloth" in key]
        found["worst"] = min(row[key] for row in synthetic for key in keys)
    for row in rows:
        if row["material"] == PLANTED:
            found["planted"] = min(row["numeric"], row["sphere, exact"], row["cloth, exact"])
    missed = False
    for name, value in found.items():
        target = TARGETS[name.split(",")[0]]
        missed |= value < target
        print(f"{name}: {value:.1f} dB, target {target:.0f}{'' if value >= target else ', MISSED'}")
    return int(missed)
