# SPDX-License-Identifier: GPL-3.0-or-later
"""The shared materials and maps beside the checkout; they are never part of the repository."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np

from fitter.anisotropic_measurement import AnisotropicMeasurement
from fitter.errors import NfmError
from fitter.formats import parameter_file, readers
from fitter.jobs import fit_file
from fitter.measurement import Measurement

SHARED = Path(__file__).resolve().parents[2] / "shared"
MAKE_MERL = SHARED / "tools" / "make_merl.py"
MAKE_UTIA = SHARED / "tools" / "make_utia.py"
GRACE = SHARED / "data" / "env" / "grace_probe_latlong.hdr"
GROVE = SHARED / "data" / "env" / "rnl_probe_latlong.hdr"
STUDIO = SHARED / "data" / "env" / "polyhaven_studio_small_03_1k.hdr"
GARDEN = SHARED / "data" / "env" / "polyhaven_chinese_garden_1k.hdr"  # 69 % of its light is the sun
MAPS = {"Grace": GRACE, "Grove": GROVE}  # the two of Peng et al. 2017
RGL = SHARED / "data" / "rgl"
ANISOTROPIC_NOISE, ANISOTROPIC_NEGATIVES = 0.02, 0.0005
BUDDHA = SHARED / "data" / "mesh" / "happy_vrip_res3.ply"


def require_shared() -> None:
    """Stop with a clear message where the shared folder is absent."""
    if not MAKE_MERL.is_file():
        raise NfmError(f"there is no {SHARED}: this benchmark needs the shared materials and maps")


@cache
def material_names() -> tuple[str, ...]:
    """Names of the Neural-BRDF fits of MERL materials, in the order of the file."""
    with np.load(SHARED / "data" / "merl_fits" / "nbrdf.npz") as weights:
        return tuple(sorted({key.split("/")[0] for key in weights.files}))


def rgl_names() -> tuple[str, ...]:
    """Names of the RGL materials."""
    return tuple(sorted(path.name.removesuffix("_rgb.bsdf") for path in RGL.glob("*_rgb.bsdf")))


def rgl_path(name: str) -> Path:
    """The file of one of them."""
    return RGL / f"{name}_rgb.bsdf"


def write_material(name: str, path: Path) -> None:
    """Write one of them as a MERL .binary file."""
    subprocess.run(
        [sys.executable, str(MAKE_MERL), str(path), "--nbrdf", name],
        check=True,
        stdout=subprocess.DEVNULL,
    )


def read_material(name: str) -> Measurement | AnisotropicMeasurement:
    """One of them, or a synthetic anisotropic one, read."""
    with tempfile.TemporaryDirectory(prefix="nfm-bench-") as folder:
        path = Path(folder, name)
        write = write_anisotropic if name in anisotropic_names() else write_material
        write(name, path)
        return readers.read(path)


@cache
def anisotropic_materials() -> ModuleType:
    """The tool that writes synthetic anisotropic materials, with their exact functions."""
    spec = importlib.util.spec_from_file_location("make_utia", MAKE_UTIA)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def anisotropic_names() -> tuple[str, ...]:
    """Names of the synthetic anisotropic materials, without the one that is none."""
    return tuple(name for name in anisotropic_materials().MATERIALS if name != "lambert")


def write_anisotropic(
    name: str,
    path: Path,
    noise: float = ANISOTROPIC_NOISE,
    negatives: float = ANISOTROPIC_NEGATIVES,
) -> None:
    """Write a synthetic anisotropic material as a UTIA .bin file.

    noise : standard deviation of its logarithm
    negatives : share of values that are negative
    """
    tool = anisotropic_materials()
    values = tool.build(name, tool.MATERIALS[name][1], noise, negatives)
    tool.write_bin(str(path), values)


def fitted_material(name: str, folder: Path | None) -> parameter_file.FittedMaterial:
    """The fit of a shared or synthetic material, from the folder if it is there."""
    kept = folder and folder / f"{name}{parameter_file.SUFFIX}"
    if kept and kept.is_file():
        return parameter_file.load(kept)
    fitted = fit_file.fit_measurement(read_material(name))
    if kept:
        folder.mkdir(parents=True, exist_ok=True)
        parameter_file.save(kept, fitted)
    return fitted
