# SPDX-License-Identifier: GPL-3.0-or-later
"""Honest files of every format, small where the format allows it: what the fuzzer starts from."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from fitter import synthetic
from fitter.editing.curves import CURVES
from fitter.editing.edit_document import EditDocument
from fitter.editing.edits import Sliders
from fitter.formats import parameter_file, utia
from fitter.formats.parameter_file import FittedMaterial
from fitter.grading import anisotropic_metrics
from fitter.measurement import Source
from tests.exr_files import write_exr
from tests.models import ANISOTROPIC_MODELS, MODELS
from tests.rgl_files import fields_of, glossy, tensor_bytes

HANDLES = {next(iter(CURVES)): ((0.0, 1.0, "AUTO"), (0.5, 0.4, "VECTOR"), (1.0, 0.0, "AUTO"))}


def write(folder: Path) -> dict[str, list[Path]]:
    """Write the corpus into a folder; its files by format."""
    return {
        name: sorted(maker(folder))
        for name, maker in (
            ("merl", _merl),
            ("utia-bin", _utia_bin),
            ("utia-exr", _utia_exr),
            ("rgl", _rgl),
            ("parameters", _parameters),
        )
    }


def _merl(folder: Path) -> Iterator[Path]:
    path = folder / "sample.binary"
    synthetic.write_sample(path, next(iter(synthetic.SAMPLES)))
    yield path


def _utia_bin(folder: Path) -> Iterator[Path]:
    path = folder / "sample.bin"
    utia.write_bin(path, _mosaic())
    yield path


def _utia_exr(folder: Path) -> Iterator[Path]:
    for compression, dtype in (("NO", np.float32), ("ZIP", np.float16), ("PIZ", np.float16)):
        yield write_exr(folder / f"{compression}.exr", _mosaic(), dtype, compression)


def _rgl(folder: Path) -> Iterator[Path]:
    for name, phi_i, spectral in (
        ("isotropic", (0.0,), False),
        ("spectral", (0.0,), True),
        ("anisotropic", np.linspace(0, np.pi, 5), False),
    ):
        path = folder / f"{name}.bsdf"
        path.write_bytes(tensor_bytes(fields_of(glossy, phi_i, spectral=spectral, n=8, n_theta=4)))
        yield path


def _parameters(folder: Path) -> Iterator[Path]:
    fitted = FittedMaterial(
        name="sample",
        model=MODELS["plastic"],
        source=Source("sample.binary", "merl", "0" * 64),
        fit={"objective": 0.01, "quality": "standard"},
    )
    edits = EditDocument(curves=HANDLES, drawn=HANDLES, sliders=Sliders())
    for name, material in (
        ("isotropic", fitted),
        ("edited", replace(fitted, edits=edits)),
        ("anisotropic", replace(fitted, model=ANISOTROPIC_MODELS["brushed"])),
    ):
        path = folder / f"{name}.nfm.json"
        parameter_file.save(path, material)
        yield path


def _mosaic() -> np.ndarray:
    return anisotropic_metrics.tabulate(next(iter(synthetic.ANISOTROPIC_SAMPLES.values())))
