# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality, time and memory of the fit over the shared MERL materials.

Each material is written as a MERL file and fitted by `python -m fitter fit`, a process of its own
whose CPU seconds (fitting and grading, without reading the file) and peak memory are taken.
Rendered PSNR: fitter/pictures/sphere.py under Grace Cathedral and Eucalyptus Grove, against the
table of the file (raw) and against the mean of both directions of each pair (recip): the networks
behind the files are not quite reciprocal, any BRDF model is. fitter/fitting/limits.py and
fitter/grading/readability.py say what the other columns are.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

import numpy as np

from fitter.fitting.limits import limits
from fitter.fitting.prior import DEFAULT_STRENGTH
from fitter.fitting.quality import DEFAULT_QUALITY, QUALITIES
from fitter.fitting.weights import DEFAULT_WEIGHT, WEIGHTS
from fitter.formats import merl, parameter_file
from fitter.grading.metrics import tabulate
from fitter.grading.readability import readability
from fitter.pictures.sphere import SphereScene, rendered_psnr
from runner.blender import load_extension

from . import planted, shared_data

PLANTED = "(planted)"

# CPU seconds of a fit on the machine of docs/RESULTS.md.
SECONDS = {"draft": 3, "standard": 10, "best": 40}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench fit."""
    parser.add_argument("--materials", metavar="A,B", help="default: all and a planted model")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every Nth only")
    parser.add_argument("--weight", choices=sorted(WEIGHTS), default=DEFAULT_WEIGHT)
    parser.add_argument("--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY)
    parser.add_argument("--prior", type=float, default=DEFAULT_STRENGTH, metavar="S")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here as well")
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="and as a table for docs/")


def run(arguments: argparse.Namespace) -> int:
    """Fit, grade and print the table; returns 1 if a target is missed."""
    shared_data.require_shared()
    names = [*shared_data.material_names(), PLANTED][:: arguments.every]
    if arguments.materials:
        names = arguments.materials.split(",")
    scene = SphereScene(environment_maps())
    print(f"{'material':<28}{'CPU s':>8}{'MB':>6}{'objective':>11}{'log err':>9}", end="")
    print(f"{'albedo':>8}{'error':>8}{'peak':>7}{'F falls':>8}{'G rises':>8}{'D rises':>8}", end="")
    print(f"{'turns':>6}{'dead':>5}{'raw Grace/Grove':>17}{'recip':>12}")
    rows = []
    for name in names:
        row = grade(name, fit_options(arguments), scene)
        rows.append(row)
        print(
            f"{name:<28}{row['cpu_seconds']:8.1f}{row['megabytes']:6.0f}{row['objective']:11.2e}"
            f"{row['mean_log_error']:9.4f}{row['largest_directional_albedo']:8.3f}"
            f"{row['albedo_error']:8.3f}{row['peak_ratio']:7.2f}{row['fresnel_fall']:8.2f}"
            f"{row['masking_rise']:8.2f}{row['ndf_rise']:8.2f}{row['turns']:6}{row['dead_lobes']:5}"
            f"{_pair(row['raw']):>17}{_pair(row['recip']):>12}",
            flush=True,
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(markdown_table(rows, arguments), encoding="utf-8")
    return _print_summary(rows, arguments.quality)


def fit_options(arguments: argparse.Namespace) -> list[str]:
    """Options of ./nfm fit for the materials of this run."""
    options = {name: getattr(arguments, name) for name in ("weight", "quality", "prior")}
    return [word for name, value in options.items() for word in (f"--{name}", str(value))]


def markdown_table(rows: list[dict], arguments: argparse.Namespace) -> str:
    """The rows as docs/results/fit.md shows them."""
    command = "./nfm bench fit"
    for name, default in (("quality", DEFAULT_QUALITY), ("prior", DEFAULT_STRENGTH)):
        if getattr(arguments, name) != default:
            command += f" --{name} {getattr(arguments, name)}"
    command += f" --markdown docs/results/{arguments.markdown.name}"
    lines = [
        "# Fits of the shared materials",
        "",
        f"Written by `{command}`; what the columns mean is in",
        "[RESULTS.md](../RESULTS.md). PSNR in dB, Grace/Grove.",
        "",
        "| material | CPU s | MB | objective | log error | albedo | albedo error | peak | F falls "
        "| G rises | D rises | turns | dead | PSNR raw | PSNR recip |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row['material']} | {row['cpu_seconds']:.1f} | {row['megabytes']:.0f} "
        f"| {row['objective']:.2e} | {row['mean_log_error']:.4f} "
        f"| {row['largest_directional_albedo']:.3f} | {100 * row['albedo_error']:.1f} % "
        f"| {row['peak_ratio']:.2f} | {row['fresnel_fall']:.2f} | {row['masking_rise']:.2f} "
        f"| {row['ndf_rise']:.2f} | {row['turns']} | {row['dead_lobes']} "
        f"| {_pair(row['raw'])} | {_pair(row['recip'])} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def _pair(values: list[float]) -> str:
    return "/".join(f"{value:.1f}" for value in values)


def grade(name: str, options: list[str], scene: SphereScene) -> dict:
    """Fit one material with options of ./nfm fit and return its figures."""
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        measured, fitted = Path(folder, "measured.binary"), Path(folder, "fitted.nfm.json")
        if name == PLANTED:
            planted.write(measured)
        else:
            shared_data.write_material(name, measured)
        row = {"material": name, **timed_fit(measured, fitted, options)}
        measurement = merl.read(measured)
        model = parameter_file.load(fitted).model
        values = tabulate(model)
        row.update(readability(model).figures(), **limits(values, measurement).figures())
        picture = scene.render(values)
    table = np.where(measurement.valid[..., None], measurement.f_r, 0)
    # phi_d and pi - phi_d hold the same pair with wi and wo swapped
    reciprocal = (table + table[:, :, ::-1]) / 2
    row["raw"] = rendered_psnr(picture, scene.render(table)).tolist()
    row["recip"] = rendered_psnr(picture, scene.render(reciprocal)).tolist()
    return row


def environment_maps() -> list[np.ndarray]:
    """Grace and Grove as Blender reads them."""
    images = import_module(f"{load_extension().__name__}.nfm_addon.images")
    return [images.read_linear(path) for path in (shared_data.GRACE, shared_data.GROVE)]


def timed_fit(measured: Path, fitted: Path, options: list[str]) -> dict:
    """Figures of ./nfm fit in a process of its own, with its peak memory in megabytes."""
    command = ["fit", str(measured), "-o", str(fitted), *options, "--json"]
    process = subprocess.Popen(
        [sys.executable, "-m", "fitter", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd=Path(__file__).parents[1],
    )
    megabytes = 0.0
    while process.poll() is None:
        megabytes = max(megabytes, _peak_megabytes(process.pid))
        time.sleep(0.02)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, "fitter")
    return {**json.loads(process.stdout.read()), "megabytes": megabytes}


def _peak_megabytes(pid: int) -> float:
    """Peak resident memory so far. Not ru_maxrss: that starts from the size of this process."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return 0.0  # a process that has ended has no memory


def _print_summary(rows: list[dict], quality: str) -> int:
    materials = [row for row in rows if row["material"] != PLANTED]
    checks = []
    if materials:
        raw = [statistics.mean(row["raw"]) for row in materials]
        recip = [statistics.mean(row["recip"]) for row in materials]
        print(f"\n{len(materials)} materials, rendered PSNR as the mean of both maps:")
        for label, values in (("raw", raw), ("recip", recip)):
            print(
                f"  {label:<6} mean {statistics.mean(values):.2f} dB, median "
                f"{statistics.median(values):.2f}, min {min(values):.2f}"
            )
        for figure in ("fresnel_fall", "masking_rise", "ndf_rise", "turns", "dead_lobes"):
            mean = statistics.mean(row[figure] for row in materials)
            print(
                f"  {figure:<13} mean {mean:.3f}, largest {max(r[figure] for r in materials):.2f}"
            )
        errors = [row["albedo_error"] for row in materials]
        print(
            f"  albedo error  median {statistics.median(errors):.3f}, "
            f"90 % {np.quantile(errors, 0.9):.3f}, largest {max(errors):.3f}; within 2 %: "
            f"{sum(error <= 0.02 for error in errors)}"
        )
        seconds = [row["cpu_seconds"] for row in materials]
        print(f"  CPU seconds   median {statistics.median(seconds):.1f}, most {max(seconds):.1f}")
        checks += [
            ("mean rendered PSNR (raw) at least 49.5 dB", statistics.mean(raw), 49.5, 1),
            ("mean rendered PSNR (recip) at least 49.5 dB", statistics.mean(recip), 49.5, 1),
            ("smallest rendered PSNR (raw) at least 36 dB", min(raw), 36, 1),
            ("median CPU seconds", statistics.median(seconds), SECONDS[quality], -1),
            ("largest MB at most 500", max(r["megabytes"] for r in rows), 500, -1),
            ("largest albedo error at most 2 %", max(errors), 0.02, -1),
            (
                "largest albedo at most 1",
                max(r["largest_directional_albedo"] for r in materials),
                1,
                -1,
            ),
            ("no value above 3 x the data's", max(r["peak_ratio"] for r in materials), 3, -1),
        ]
    for row in rows:
        if row["material"] == PLANTED:
            psnr = statistics.mean(row["raw"])
            checks.append(("planted model recovered to 80 dB", psnr, 80, 1))
    missed = 0
    for label, value, bound, sign in checks:
        ok = sign * (value - bound) >= 0
        missed += not ok
        print(f"  {'ok    ' if ok else 'MISSED'} {label}: {value:.2f}")
    return 1 if missed else 0
