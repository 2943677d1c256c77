# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs of ./nfm that work inside Blender, and of `blender --command nfm`.

fit, export and eval come from the fitter, which also runs without Blender; render and demo are
added here.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import bpy

from ..fitter import command_line as fitter_command_line
from ..fitter import synthetic
from ..fitter.errors import NfmError, shown_name
from ..fitter.formats.parameter_file import FittedMaterial
from ..fitter.jobs import batch
from ..fitter.jobs.fit_file import material_from_file
from ..fitter.jobs.progress import Progress
from ..fitter.models.factors import Factors
from ..fitter.models.model import FactorModel
from . import demo_light, images, material, script_node
from .cloth_scene import build_cloth_scene
from .demo import scene as demo_scene
from .editing.rendered_model import rendered_model
from .evaluate import evaluate_through_osl
from .properties import DEFAULT_SAMPLING, SAMPLING_ITEMS
from .rendering import check_output, render_to_file
from .standard_sphere import SphereView, build_scene

SAMPLINGS = [identifier.lower() for identifier, *_ in SAMPLING_ITEMS]
SCENES = {"sphere": build_scene, "cloth": build_cloth_scene}
DEMO_SAMPLE = "copper-paint"
CHECKOUT = Path(__file__).resolve().parents[1]


def main(argv: Sequence[str]) -> int:
    """Run a verb; returns the exit status: 0, or 1 if it failed. Bad usage exits with 2."""
    parser = argparse.ArgumentParser(
        prog="nfm", description="Measured materials: fit, evaluate and render them."
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    _add_demo_verb(verbs)
    fitter_command_line.add_fit_verb(verbs)
    _add_export_verb(verbs)
    _add_eval_verb(verbs)
    _add_render_verb(verbs)
    return fitter_command_line.run(parser, argv)


def _add_eval_verb(verbs: argparse._SubParsersAction) -> None:
    parser = fitter_command_line.add_eval_verb(verbs)
    parser.add_argument(
        "--through",
        choices=["numpy", "osl"],
        default="numpy",
        help="osl evaluates the very shader that renders, inside Cycles",
    )
    evaluators = {"numpy": FactorModel.f_r, "osl": evaluate_through_osl}
    parser.set_defaults(
        run=lambda arguments: fitter_command_line.run_eval(arguments, evaluators[arguments.through])
    )


def _add_export_verb(verbs: argparse._SubParsersAction) -> None:
    parser = fitter_command_line.add_export_verb(verbs)
    parser.set_defaults(run=lambda arguments: fitter_command_line.run_export(arguments, _edited))


def _edited(fitted: FittedMaterial) -> Factors:
    """The model of a preset with its edits."""
    new = material.build(fitted)
    try:
        return rendered_model(new)
    finally:
        material.remove(new)


def _add_render_verb(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("render", help="render the standard sphere, or cloths")
    parser.add_argument("file", metavar="FILE_OR_PARAMS", help="a measured file or .nfm.json")
    fitter_command_line.add_quality_option(parser)
    parser.add_argument("-o", "--output", metavar="OUT.exr|OUT.png", required=True, type=Path)
    parser.add_argument(
        "--scene",
        choices=SCENES,
        default="sphere",
        help="cloth: three draped cloths with the material at 0, 45 and 90 degrees, three times as "
        "wide as high",
    )
    parser.add_argument("--env", metavar="MAP.hdr", type=Path, help="default: uniform white 1")
    parser.add_argument("--samples", type=_integer(1, 2**24), default=64, metavar="N")
    parser.add_argument("--seed", type=_integer(0, 2**31 - 1), default=0, metavar="N")
    parser.add_argument("--resolution", type=_integer(4, 65536), default=256, metavar="R")
    parser.add_argument("--sampling", choices=SAMPLINGS, default=DEFAULT_SAMPLING.lower())
    parser.add_argument(
        "--candidates",
        type=_integer(1, 63),  # Cycles has room for 64 closures, the diffuse one included
        metavar="K",
        help="candidate directions per shading point; default: 4 in reference, 2 in exact and "
        "smooth sampling, 1 in cosine; native has none",
    )
    parser.add_argument(
        "--point-sampled", action="store_true", help="rays through the pixel centres"
    )
    parser.set_defaults(run=_run_render)


def _run_render(arguments: argparse.Namespace) -> None:
    # before ten seconds of fitting, not after
    check_output(arguments.output)
    if arguments.env and not arguments.env.is_file():
        raise NfmError(f"{shown_name(arguments.env)}: no such image; check the path")
    fitted = _fitted(arguments.file, arguments.quality)
    view = SphereView(
        resolution=arguments.resolution,
        samples=arguments.samples,
        seed=arguments.seed,
        point_sampled=arguments.point_sampled,
        environment=arguments.env,
    )
    new = material.build(fitted, arguments.sampling.upper())
    if arguments.candidates is not None:
        material.find_script_node(new).inputs["Candidates"].default_value = arguments.candidates
    _render(new, SCENES[arguments.scene], view, arguments.output)
    sys.stdout.write(f"written to      {arguments.output}\n")


def _add_demo_verb(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("demo", help="fit and render a sample material")
    parser.add_argument(
        "file", metavar="FILE", nargs="?", help="a measured file; default: a synthetic sample"
    )
    fitter_command_line.add_quality_option(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        type=Path,
        help="default: nfm-demo here; of --rebuild the checkout",
    )
    parser.add_argument(
        "--rebuild",
        action="store_true",
        help=f"write {demo_scene.FILE_NAME}, a scene with many materials, instead",
    )
    parser.set_defaults(run=_run_demo)


def _run_demo(arguments: argparse.Namespace) -> None:
    if arguments.rebuild:
        _rebuild_demo(batch.made_folder(arguments.output or CHECKOUT) / demo_scene.FILE_NAME)
    else:
        _fit_sample(arguments, batch.made_folder(arguments.output or Path("nfm-demo")))


def _rebuild_demo(path: Path) -> None:
    script_node.require_osl()
    demo_scene.write(path)
    size = path.stat().st_size
    sys.stdout.write(f"written to      {path}, {size / 1e6:.2f} MB\n")


def _fit_sample(arguments: argparse.Namespace, folder: Path) -> None:
    path = arguments.file
    if path is None:
        path = folder / f"synthetic-{DEMO_SAMPLE}.binary"
        synthetic.write_sample(path, DEMO_SAMPLE)
        sys.stdout.write(
            f"{path} is a synthetic sample in the MERL format, computed from an analytic model.\n"
            "To see a measured material: ./nfm demo FILE.binary; a scene of many: "
            f"{demo_scene.FILE_NAME}\n\n"
        )
    start = time.perf_counter()
    fitted = _fitted(path, arguments.quality)
    seconds = time.perf_counter() - start
    new = material.build(fitted)
    native = {name: getattr(new.nfm, name) for name in ("native_error", "native_psnr")}
    sys.stdout.write(fitter_command_line.report_text(fitted, seconds=seconds, **native))
    sys.stdout.flush()

    environment = folder / "studio.exr"
    images.write_linear(environment, demo_light.studio())
    picture = folder / f"{Path(path).stem}.png"
    view = SphereView(resolution=512, samples=128, environment=environment)
    _render(new, build_scene, view, picture)
    sys.stdout.write(f"\nThe picture is {picture.resolve()}\n")


def _fitted(path: str | Path, quality: str) -> FittedMaterial:
    with Progress(sys.stderr, "fit") as progress:
        return material_from_file(
            path,
            quality=quality,
            on_step=lambda step: progress.update(step.progress, step.stage),
        )


def _render(
    new: bpy.types.Material,
    build: Callable[[bpy.types.Material, SphereView], bpy.types.Scene],
    view: SphereView,
    output: Path,
) -> None:
    script_node.require_osl()
    scene = build(new, view)
    with Progress(sys.stderr, "render") as progress:
        render_to_file(scene, output, lambda share: progress.update(share, "rendering"))


def _integer(low: int, high: int) -> Callable[[str], int]:
    """Argument type: a whole number that Blender takes as it is, neither refused nor clamped."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text[:40]!r} is not a whole number from {low} to {high}"
            )
        return value

    return parse
