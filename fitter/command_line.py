# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs that need no Blender: fit, export and eval. The add-on's command line has them too."""

from __future__ import annotations

import argparse
import io
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from .errors import NfmError, printable, shown_name
from .files import write_atomically
from .fitting.prior import DEFAULT_STRENGTH
from .fitting.quality import DEFAULT_QUALITY, QUALITIES
from .fitting.weights import DEFAULT_WEIGHT, WEIGHTS
from .formats import export, parameter_file, readers, utia
from .formats.parameter_file import FittedMaterial
from .jobs import batch, cluster
from .jobs.fit_file import fit_measurement
from .jobs.progress import Progress
from .models.factors import Factors
from .shading.shading import shade

FAILED = 1

# How far from 1 the length of a direction may be: far more than rounding, less than a mistake.
UNIT_TOLERANCE = 1e-3

# Label, name among the figures of a fit, format.
REPORT = (
    ("bins used", "bins_usable", "{:,.0f}"),
    ("  negative", "bins_negative", "{:,.0f}"),
    ("  not finite", "bins_not_finite", "{:,.0f}"),
    ("  below horizon", "bins_below_horizon", "{:,.0f}"),
    ("  out of gamut", "bins_clamped", "{:,.0f} (negative channels set to 0)"),
    ("encoding", "encoding", "{}"),
    ("objective", "objective", "{:.3e}"),
    ("iterations", "iterations", "{:.0f}"),
    ("seconds", "seconds", "{:.1f}"),
    ("mean log error", "mean_log_error", "{:.4f}"),
    ("numeric PSNR", "numeric_psnr", "{:.1f} dB over the data"),
    ("main direction", "anisotropy_direction", "{:.1f} degrees from the tangent"),
    ("anisotropy", "anisotropy_strength", "{:.2f} (0: none, 1: all)"),
    ("largest albedo", "largest_directional_albedo", "{:.3f} (directional, up to 88 degrees)"),
    ("native sampling", "native_error", "{:.2%} error of a picture in a studio"),
    ("", "native_psnr", "{:.1f} dB against the model"),
    ("", "native_directional_error", "{:.2%} error over all directions"),
)

Evaluate = Callable[[Factors, np.ndarray, np.ndarray], np.ndarray]


def add_fit_verb(verbs: argparse._SubParsersAction) -> None:
    """Fit FILE and write its parameter file, or all files of a folder."""
    parser = verbs.add_parser("fit", help="fit a measured BRDF and write its parameter file")
    parser.add_argument("file", metavar="FILE", help=f"{readers.EXPECTED}, or a folder of such")
    parser.add_argument(
        "-o",
        "--output",
        "--out",
        metavar="OUT",
        help="default: the file's name with .nfm.json, here; a folder for a folder",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", metavar="N", type=positive, default=2, help="processes for a folder; default: 2"
    )
    where.add_argument(
        "--dask", metavar="tcp://HOST:PORT", help="fit a folder on a Dask cluster instead"
    )
    parser.add_argument("--model", choices=["shared3"], default="shared3")
    parser.add_argument(
        "--weight", choices=sorted(WEIGHTS), default=DEFAULT_WEIGHT, help="weight of the objective"
    )
    parser.add_argument(
        "--encoding",
        choices=sorted(utia.ENCODINGS),
        help=f"how to take the numbers of UTIA files; default: {utia.DEFAULT_ENCODING}",
    )
    add_quality_option(parser)
    parser.add_argument(
        "--prior",
        type=_not_negative,
        default=DEFAULT_STRENGTH,
        metavar="S",
        help=f"how much factors in order are preferred; 0: not at all, default: {DEFAULT_STRENGTH}",
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.set_defaults(run=run_fit)


def add_quality_option(parser: argparse.ArgumentParser) -> None:
    """The option --quality of every verb that fits."""
    parser.add_argument(
        "--quality",
        choices=list(QUALITIES),
        default=DEFAULT_QUALITY,
        help=f"how long a fit may take; default: {DEFAULT_QUALITY}",
    )


def _not_negative(text: str) -> float:
    value = float(text)
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0")
    return value


def positive(text: str) -> int:
    """Argument type: a whole number from 1."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number}, expected at least 1")
    return number


def run_fit(arguments: argparse.Namespace) -> None:
    """The verb fit."""
    if Path(arguments.file).is_dir():
        _fit_folder(arguments)
    else:
        _fit_file(arguments)


def _fit_folder(arguments: argparse.Namespace) -> None:
    if not arguments.output:
        raise NfmError(
            f"{shown_name(arguments.file)}: a folder; say with --output where its fits go"
        )
    output = batch.made_folder(Path(arguments.output))
    jobs = batch.jobs_of(Path(arguments.file), output)
    settings = batch.Settings(
        arguments.weight, arguments.quality, arguments.prior, arguments.encoding
    )
    if arguments.dask:
        running = cluster.run(jobs, settings, arguments.dask)
    else:
        running = batch.run(jobs, settings, arguments.jobs)
    outcomes: list[batch.Outcome] = []
    with Progress(sys.stderr, "fit") as progress:
        progress.update(0, f"0 of {len(jobs)} files")
        for outcome in running:
            if outcome is not None:
                outcomes.append(outcome)
                done = f"{len(outcomes)} of {len(jobs)} files"
                progress.update(len(outcomes) / len(jobs), done)
    rows = batch.write_summary(output, outcomes)
    sys.stdout.write(f"{rows}\n" if arguments.json else batch.summary_text(outcomes))
    failed = sum(outcome.status == batch.FAILED for outcome in outcomes)
    if failed:
        raise NfmError(f"{failed} of {len(jobs)} files could not be fitted; see above")


def _fit_file(arguments: argparse.Namespace) -> None:
    start = time.perf_counter()
    if arguments.output and not Path(arguments.output).parent.is_dir():
        # before ten seconds of work, not after
        raise NfmError(f"{shown_name(arguments.output)}: there is no such folder; make it first")
    measurement = readers.read(arguments.file, encoding=arguments.encoding)
    cpu_start = time.process_time()
    with Progress(sys.stderr, "fit") as progress:
        material = fit_measurement(
            measurement,
            weight=arguments.weight,
            quality=arguments.quality,
            prior_strength=arguments.prior,
            on_step=lambda step: progress.update(step.progress, step.stage),
        )
    native = _native_figures(material.model)
    cpu_seconds = time.process_time() - cpu_start
    seconds = time.perf_counter() - start
    output = Path(arguments.output or f"{material.name}{parameter_file.SUFFIX}")
    parameter_file.save(output, material)
    if arguments.json:
        report = {"output": str(output), "seconds": round(seconds, 3), **material.fit, **native}
        report["cpu_seconds"] = round(cpu_seconds, 3)  # of fitting and grading
        sys.stdout.write(json.dumps(report) + "\n")
    else:
        sys.stdout.write(
            report_text(material, seconds=seconds, **native) + f"written to      {output}\n"
        )


def _native_figures(model: Factors) -> dict[str, float]:
    """How good the base lobes are."""
    return shade(model).error.figures()


def report_text(material: FittedMaterial, **figures: float) -> str:
    """The report for people: one figure of REPORT per line, those given and the material's own."""
    fit, model = {**material.fit, **figures}, material.model
    lines = [
        f"{'material':<16}{printable(material.name)}",
        f"{'model':<16}{model.n_lobes} lobes, {model.n_parameters} numbers",
    ]
    for label, key, text in REPORT:
        # a parameter file may come from anywhere and hold anything under a known name
        figure = fit.get(key)
        if isinstance(figure, str) if text == "{}" else isinstance(figure, (int, float)):
            shown = printable(figure) if isinstance(figure, str) else text.format(figure)
            lines.append(f"{label:<16}{shown}")
    return "".join(f"{line}\n" for line in lines)


def add_export_verb(verbs: argparse._SubParsersAction) -> argparse.ArgumentParser:
    """Write PARAMS as a file that other renderers read."""
    parser = verbs.add_parser("export", help="write a fitted BRDF as a MERL or UTIA file")
    parser.add_argument("params", metavar="PARAMS.nfm.json")
    parser.add_argument("-o", "--output", metavar="OUT.binary|OUT.bin", required=True)
    parser.add_argument(
        "--without-edits", action="store_true", help="of a preset: as it was fitted"
    )
    parser.set_defaults(run=lambda arguments: run_export(arguments, _unedited))
    return parser


def run_export(arguments: argparse.Namespace, edited: Callable[[FittedMaterial], Factors]) -> None:
    """The verb export; `edited` applies the edits of a preset."""
    output = Path(arguments.output)
    material = parameter_file.load(arguments.params)
    has_edits = material.edits is not None and not arguments.without_edits
    export.write(output, edited(material) if has_edits else material.model)
    sys.stdout.write(f"written to      {output}\n")


def _unedited(material: FittedMaterial) -> Factors:
    raise NfmError(
        f"{printable(material.name)}: a preset with edits, whose curves only Blender can draw; use "
        "./nfm export or blender --command nfm export, or --without-edits"
    )


def add_eval_verb(verbs: argparse._SubParsersAction) -> argparse.ArgumentParser:
    """Evaluate PARAMS for pairs of directions."""
    parser = verbs.add_parser("eval", help="evaluate a fitted BRDF for pairs of directions")
    parser.add_argument("params", metavar="PARAMS.nfm.json")
    parser.add_argument(
        "--directions",
        metavar="IN.npy",
        required=True,
        help="(n, 6) numbers: unit wi and wo in the local frame, z = normal",
    )
    parser.add_argument("-o", "--output", metavar="OUT.npy", required=True, help="(n, 3) f in 1/sr")
    parser.set_defaults(run=lambda arguments: run_eval(arguments, Factors.f_r))
    return parser


def run_eval(arguments: argparse.Namespace, evaluate: Evaluate) -> None:
    """The verb eval with any evaluator."""
    material = parameter_file.load(arguments.params)
    wi, wo = read_directions(arguments.directions)
    values = evaluate(material.model, wi, wo)
    array = io.BytesIO()
    np.save(array, values)
    try:
        write_atomically(Path(arguments.output), [array.getbuffer()])
    except OSError as error:
        raise NfmError(
            f"{shown_name(arguments.output)}: cannot be written ({error.strerror}); choose another"
        ) from error


def read_directions(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Unit wi and wo (n, 3) of a .npy file of shape (n, 6), rounded to single precision.

    That is how a renderer sees them. Where wi and wo are grazing and nearly opposite, h = wi + wo
    depends on their last digits; rounded first, every evaluator gets the same h.

    Raises
    ------
    NfmError
        The file is not such an array, or a direction is not of unit length.
    """
    name = shown_name(path)
    try:
        pairs = np.load(path, allow_pickle=False)
    except Exception as error:
        # whatever the parsers behind np.load raise: zipfile, tokenize, MemoryError, OverflowError
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise NfmError(f"{name}: cannot be read as a .npy array ({reason}); check it") from None
    if getattr(pairs, "ndim", 0) != 2 or pairs.shape[1] != 6 or pairs.dtype.kind not in "fiu":
        shape = getattr(pairs, "shape", "several arrays")
        raise NfmError(f"{name}: shape {shape}, expected (n, 6) numbers: wi and wo in each row")
    with np.errstate(over="ignore"):  # what single precision cannot hold is not of unit length
        pairs = pairs.astype(np.float32).astype(np.float64)
    lengths = np.linalg.norm(pairs.reshape(-1, 2, 3), axis=-1)
    # written so that NaN counts as wrong
    wrong = ~(np.abs(lengths - 1) < UNIT_TOLERANCE).all(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise NfmError(
            f"{name}: row {row} has directions of length {lengths[row].round(4).tolist()}, "
            "expected unit vectors; normalise them"
        )
    return pairs[:, :3], pairs[:, 3:]


def run(parser: argparse.ArgumentParser, argv: Sequence[str]) -> int:
    """Parse, run the verb and turn errors of files into one line; returns the exit status.

    argparse itself exits with 2 on bad usage.
    """
    arguments = parser.parse_args(argv)
    try:
        arguments.run(arguments)
    except NfmError as error:
        sys.stderr.write(f"nfm: {error}\n")
        return FAILED
    return 0


def main(argv: Sequence[str]) -> int:
    """Command line of the fitter alone; returns the exit status."""
    parser = argparse.ArgumentParser(prog="nfm", description="Measured materials without Blender.")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    add_fit_verb(verbs)
    add_export_verb(verbs)
    add_eval_verb(verbs)
    return run(parser, argv)
