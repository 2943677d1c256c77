# SPDX-License-Identifier: GPL-3.0-or-later
"""Finished results in a folder, so that an interrupted comparison goes on where it stopped.

A result is filed under everything it depends on: the measured file's bytes, the settings, the
scenes and the code that fits and grades. What is not the same in all of these is not found, and
fitted again. Nothing in these files is executed.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np

from fitter.errors import NfmError, shown_name
from fitter.files import write_atomically
from fitter.grading.slices import INCIDENCE, THETA_O
from fitter.models.model import FactorModel

from .grading import FACTORS, Grades, Result
from .models import KEYS, Settings
from .scenes import SceneSource

CHECKOUT = Path(__file__).resolve().parents[1]

# The modules of this package whose change makes results stale; those that draw and write do not.
OWN_MODULES = ("grading", "mesh", "models", "scenes", "store")


@cache
def code_version() -> str:
    """Hash of the code that results depend on, and of numpy's version."""
    digest = hashlib.sha256(np.__version__.encode())
    own = [CHECKOUT / "compare" / f"{name}.py" for name in OWN_MODULES]
    for path in sorted(CHECKOUT.glob("fitter/**/*.py")) + own:
        digest.update(path.relative_to(CHECKOUT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def result_key(sha256: str, settings: Settings, scenes: Sequence[SceneSource]) -> str:
    """Name of a result's file, without suffix."""
    depends_on = [sha256, asdict(settings), [s.fingerprint for s in scenes], code_version()]
    return hashlib.sha256(json.dumps(depends_on).encode()).hexdigest()[:32]


class Store:
    """A folder of results."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def save(self, key: str, result: Result) -> None:
        """Write a result, all or nothing.

        Raises
        ------
        NfmError
            It cannot be written.
        """
        about = {
            "name": result.name,
            "sha256": result.sha256,
            "grades": {model: asdict(grades) for model, grades in result.grades.items()},
        }
        arrays = {"about": np.array(json.dumps(about)), "slices": result.slices}
        arrays |= {f"picture {n}": array for n, array in enumerate(result.pictures)}
        for model, factors in result.factors.items():
            arrays |= {f"{model} {name}": getattr(factors, name) for name in FACTORS}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_atomically(self._path(key), [buffer.getbuffer()])
        except OSError as error:
            raise NfmError(
                f"{shown_name(self._folder)}: cannot be written ({error.strerror or error}); "
                "choose another folder"
            ) from error

    def load(self, key: str) -> Result | None:
        """A result, or None where there is none that can be used."""
        try:
            with np.load(self._path(key), allow_pickle=False) as arrays:
                return _result(dict(arrays))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            # cut off or damaged: as good as not there
            return None

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.npz"


def _result(arrays: dict[str, np.ndarray]) -> Result:
    about = json.loads(arrays["about"].item())
    grades = {}
    for key in KEYS:
        figures = about["grades"][key]
        grades[key] = Grades(**figures | {"rendered_psnr": tuple(figures["rendered_psnr"])})
    slices = arrays["slices"]
    if slices.shape != (1 + len(KEYS), len(INCIDENCE), len(THETA_O), 3):
        raise ValueError("slices of another shape")
    n_scenes = len(grades[KEYS[0]].rendered_psnr)
    return Result(
        name=about["name"],
        sha256=about["sha256"],
        grades=grades,
        pictures=tuple(arrays[f"picture {n}"] for n in range(n_scenes)),
        slices=slices,
        factors={
            key: FactorModel(**{name: arrays[f"{key} {name}"] for name in FACTORS})
            for key in KEYS
            if f"{key} ndf" in arrays
        },
    )
