# SPDX-License-Identifier: GPL-3.0-or-later
"""What experiments with the fit share: some materials, and how near a table comes to each.

Scene and PSNR are those of ./nfm bench fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from fitter.measurement import Measurement
from fitter.pictures.sphere import SphereScene, rendered_psnr

from . import shared_data
from .fit import environment_maps

MATERIALS = (
    "aluminium",
    "black-obsidian",
    "blue-metallic-paint",
    "blue-rubber",
    "colonial-maple-223",
    "green-latex",
    "nylon",
    "polyurethane-foam",
    "red-plastic",
    "specular-blue-phenolic",
    "violet-acrylic",
    "white-fabric",
)


class Pictured(NamedTuple):
    """A material of the experiment.

    psnr : of the picture of a table (90, 90, 180, 3) against that of the measurement, dB, the mean
        of both maps
    """

    name: str
    measurement: Measurement
    psnr: Callable[[np.ndarray], float]


def materials(names: Sequence[str]) -> Iterator[Pictured]:
    """The materials of these names, each read when it is its turn.

    Raises
    ------
    NfmError
        The shared materials are not there.
    """
    shared_data.require_shared()
    scene = SphereScene(environment_maps())
    return (_pictured(name, scene) for name in names)


def _pictured(name: str, scene: SphereScene) -> Pictured:
    measurement = shared_data.read_material(name)
    return Pictured(name, measurement, partial(_psnr, scene, scene.render(measurement.f_r)))


def _psnr(scene: SphereScene, reference: np.ndarray, table: np.ndarray) -> float:
    return float(rendered_psnr(scene.render(table), reference).mean())
