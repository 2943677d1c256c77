# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit every model to one measurement and keep all that a report shows."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitter.baselines.independent_g import IndependentG
from fitter.grading.metrics import mean_log_error, numeric_psnr, relative_objective, tabulate
from fitter.grading.slices import measured_slices, model_slices
from fitter.jobs.fit_file import material_name
from fitter.measurement import Measurement
from fitter.models.model import FactorModel
from fitter.pictures.sphere import LitScene, rendered_psnr

from .models import CONTENDERS, Settings

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


def _picture(scene: LitScene, pixels: np.ndarray) -> np.ndarray:
    picture = np.full((*scene.mask.shape, 3), np.nan, np.float32)
    picture[scene.mask] = pixels
    return picture
