# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit every model to one measurement and keep all that a report shows."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitter.fit_file import material_name
from fitter.independent_g import IndependentG
from fitter.measurement import Measurement
from fitter.metrics import mean_log_error, numeric_psnr, relative_objective, tabulate
from fitter.model import FactorModel
from fitter.sphere import LitScene, rendered_psnr

from .models import CONTENDERS, Fitted, Settings

# Polar slices: angles of incidence, and theta_o in the plane of incidence, radians.
INCIDENCE = np.radians([10.0, 30.0, 60.0, 80.0])
THETA_O = np.radians(np.arange(-89.5, 90, 0.5))

# Out of that plane by this azimuth, so that rounding does not choose between the bins of phi_d at
# both of its ends, which hold the same pair with wi and wo swapped.
OUT_OF_PLANE = 1e-6

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


@dataclass(frozen=True)
class Grades:
    """Figures of one model.

    seconds : CPU time of the fit
    objective : metrics.relative_objective under the weight of the fit
    numeric_psnr, mean_log_error : see metrics
    rendered_psnr : dB, one for each scene
    """

    n_parameters: int
    seconds: float
    objective: float
    mean_log_error: float
    numeric_psnr: float
    rendered_psnr: tuple[float, ...]

    @property
    def mean_psnr(self) -> float:
        """Mean rendered PSNR over the scenes, dB; NaN without scenes."""
        return float(np.mean(self.rendered_psnr)) if self.rendered_psnr else float("nan")


@dataclass(frozen=True)
class Result:
    """All about one material; the models are in the order of CONTENDERS.

    pictures : for each scene (1 + models, height, width, 3), linear, NaN beside the object; first
        that of the data
    slices : (1 + models, incidence, theta_o, 3) f_r, 1/sr; first the data, NaN where there is none
    factors : by key of the models that have factors
    """

    name: str
    sha256: str
    grades: dict[str, Grades]
    pictures: tuple[np.ndarray, ...]
    slices: np.ndarray
    factors: dict[str, FactorModel]


def grade(
    measurement: Measurement,
    settings: Settings,
    scenes: Sequence[LitScene],
    on_step: Callable[[], None] = lambda: None,
) -> Result:
    """Fit and grade; on_step is called once for each model."""
    grades, factors = {}, {}
    pixels = [[scene.render(measurement.f_r)[0]] for scene in scenes]
    slices = [measured_slices(measurement)]
    for contender in CONTENDERS:
        start = time.process_time()
        model = contender.fit(measurement, settings)
        seconds = time.process_time() - start
        table = tabulate(model)
        for scene, rows in zip(scenes, pixels, strict=True):
            rows.append(scene.render(table)[0])
        slices.append(model_slices(model))
        grades[contender.key] = Grades(
            n_parameters=model.n_parameters,
            seconds=seconds,
            objective=relative_objective(table, measurement, settings.weight),
            mean_log_error=mean_log_error(table, measurement),
            numeric_psnr=numeric_psnr(table, measurement),
            rendered_psnr=tuple(
                float(rendered_psnr(rows[-1][None], rows[0][None])[0]) for rows in pixels
            ),
        )
        if isinstance(model, FactorModel):
            factors[contender.key] = model
        elif isinstance(model, IndependentG):
            factors[contender.key] = model.factors
        on_step()
    return Result(
        name=material_name(measurement.source.file_name),
        sha256=measurement.source.sha256,
        grades=grades,
        pictures=tuple(
            np.stack([_picture(scene, row) for row in rows])
            for scene, rows in zip(scenes, pixels, strict=True)
        ),
        slices=np.array(slices, np.float32),
        factors=factors,
    )


def model_slices(model: Fitted) -> np.ndarray:
    """f_r (incidence, theta_o, 3) in the plane of incidence; wi lies at negative theta_o."""
    return np.stack([model.f_r(*_pairs(theta_i, 0.0)) for theta_i in INCIDENCE])


def measured_slices(measurement: Measurement) -> np.ndarray:
    """The same of the data: the mean of both orders of a pair where both were measured."""
    slices = []
    for theta_i in INCIDENCE:
        values = []
        for azimuth in (-OUT_OF_PLANE, OUT_OF_PLANE):
            wi, wo = _pairs(theta_i, azimuth)
            valid = measurement.lookup_valid(wi, wo)[:, None]
            values.append(np.where(valid, measurement.lookup(wi, wo), np.nan))
        known = ~np.isnan(values)
        total = np.where(known, values, 0).sum(0)
        slices.append(np.where(known.any(0), total / np.maximum(known.sum(0), 1), np.nan))
    return np.stack(slices)


def _picture(scene: LitScene, pixels: np.ndarray) -> np.ndarray:
    picture = np.full((*scene.mask.shape, 3), np.nan, np.float32)
    picture[scene.mask] = pixels
    return picture


def _pairs(theta_i: float, azimuth: float) -> tuple[np.ndarray, np.ndarray]:
    """Wi and wo (n, 3) for all of THETA_O: wi leans to -x, so the mirror direction is at +."""
    wi = np.array([-np.sin(theta_i), 0.0, np.cos(theta_i)])
    sin = np.sin(THETA_O)
    wo = np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), np.cos(THETA_O)], -1)
    return np.broadcast_to(wi, wo.shape), wo
