# SPDX-License-Identifier: GPL-3.0-or-later
"""Quality, time and memory of the fit over the shared MERL materials.

Each material is written as a MERL file and fitted by `python -m fitter fit`, a process of its own
whose wall time and peak memory are taken. Rendered PSNR: fitter/sphere.py under Grace Cathedral
and Eucalyptus Grove, against the table of the file (raw) and against the mean of both directions
of each pair (recip): the networks behind the files are not quite reciprocal, any BRDF model is.
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

from fitter import merl, parameter_file
from fitter.metrics import tabulate
from fitter.sphere import SphereScene, rendered_psnr
from fitter.weights import DEFAULT_WEIGHT, WEIGHTS
from runner.blender import load_extension

from . import planted, shared_data

PLANTED = "(planted)"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench fit."""
    parser.add_argument("--materials", metavar="A,B", help="default: all and a planted model")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every Nth only")
    parser.add_argument("--weight", choices=sorted(WEIGHTS), default=DEFAULT_WEIGHT)
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the rows here as well")
    parser.add_argument("--markdown", metavar="FILE", type=Path, help="and as a table for docs/")


def run(arguments: argparse.Namespace) -> int:
    """Fit, grade and print the table; returns 1 if a target is missed."""
    shared_data.require_shared()
    names = [*shared_data.material_names(), PLANTED][:: arguments.every]
    if arguments.materials:
        names = arguments.materials.split(",")
    scene = SphereScene(environment_maps())
    print(f"{'material':<28}{'seconds':>8}{'MB':>6}{'objective':>11}{'log err':>9}", end="")
    print(f"{'albedo':>8}{'raw Grace/Grove':>17}{'recip':>12}")
    rows = []
    for name in names:
        row = grade(name, arguments.weight, scene)
        rows.append(row)
        print(
            f"{name:<28}{row['seconds']:8.1f}{row['megabytes']:6.0f}{row['objective']:11.2e}"
            f"{row['mean_log_error']:9.4f}{row['largest_directional_albedo']:8.3f}"
            f"{_pair(row['raw']):>17}{_pair(row['recip']):>12}",
            flush=True,
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(markdown_table(rows), encoding="utf-8")
    return _print_summary(rows)


def markdown_table(rows: list[dict]) -> str:
    """The rows as docs/results/fit.md shows them."""
    lines = [
        "# Fits of the shared materials",
        "",
        "Written by `./nfm bench fit --markdown docs/results/fit.md`; what the columns mean is in",
        "[RESULTS.md](../RESULTS.md). PSNR in dB, Grace/Grove.",
        "",
        "| material | s | MB | objective | log error | albedo | PSNR raw | PSNR recip |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row['material']} | {row['seconds']:.1f} | {row['megabytes']:.0f} "
        f"| {row['objective']:.2e} | {row['mean_log_error']:.4f} "
        f"| {row['largest_directional_albedo']:.3f} | {_pair(row['raw'])} | {_pair(row['recip'])} |"
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def _pair(values: list[float]) -> str:
    return "/".join(f"{value:.1f}" for value in values)


def grade(name: str, weight: str, scene: SphereScene) -> dict:
    """Fit one material and return its figures."""
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        measured, fitted = Path(folder, "measured.binary"), Path(folder, "fitted.nfm.json")
        if name == PLANTED:
            planted.write(measured)
        else:
            shared_data.write_material(name, measured)
        row = {"material": name, **_timed_fit(measured, fitted, weight)}
        measurement = merl.read(measured)
        picture = scene.render(tabulate(parameter_file.load(fitted).model))
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


def _timed_fit(measured: Path, fitted: Path, weight: str) -> dict:
    command = ["fit", str(measured), "-o", str(fitted), "--weight", weight, "--json"]
    start = time.perf_counter()
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
    seconds = time.perf_counter() - start
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, "fitter")
    return {**json.loads(process.stdout.read()), "seconds": seconds, "megabytes": megabytes}


def _peak_megabytes(pid: int) -> float:
    """Peak resident memory so far. Not ru_maxrss: that starts from the size of this process."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return 0.0  # a process that has ended has no memory


def _print_summary(rows: list[dict]) -> int:
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
        checks += [
            ("mean rendered PSNR (raw) at least 46 dB", statistics.mean(raw), 46, 1),
            ("smallest rendered PSNR (raw) at least 33 dB", min(raw), 33, 1),
            ("median seconds at most 12", statistics.median(r["seconds"] for r in rows), 12, -1),
            ("largest MB at most 500", max(r["megabytes"] for r in rows), 500, -1),
        ]
    for row in rows:
        if row["material"] == PLANTED:
            psnr = statistics.mean(row["raw"])
            checks.append(("planted model recovered to 70 dB", psnr, 70, 1))
    missed = 0
    for label, value, bound, sign in checks:
        ok = sign * (value - bound) >= 0
        missed += not ok
        print(f"  {'ok    ' if ok else 'MISSED'} {label}: {value:.2f}")
    return 1 if missed else 0
