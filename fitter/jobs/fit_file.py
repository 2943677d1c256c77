# SPDX-License-Identifier: GPL-3.0-or-later
"""From a file to a fitted material: read, fit, grade."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ..anisotropic import albedo as anisotropic_albedo
from ..anisotropic import fit as anisotropic_fit
from ..anisotropic_measurement import AnisotropicMeasurement
from ..errors import shown_name
from ..fitting import fit
from ..fitting.fit import FitStep
from ..fitting.prior import DEFAULT_STRENGTH
from ..fitting.quality import DEFAULT_QUALITY
from ..fitting.weights import DEFAULT_WEIGHT
from ..formats import parameter_file, readers
from ..formats.parameter_file import FittedMaterial
from ..formats.readers import AnyMeasurement
from ..grading import anisotropic_metrics, metrics
from ..measurement import Measurement
from ..models import tables
from ..models.anisotropic_model import AnisotropicModel
from ..models.anisotropy import anisotropy
from ..models.model import FactorModel
from ..shading.base_error import studio_psnr

OnStep = Callable[[FitStep], None]


def material_from_file(
    path: str | os.PathLike,
    *,
    encoding: str | None = None,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    prior_strength: float = DEFAULT_STRENGTH,
    on_step: OnStep | None = None,
) -> FittedMaterial:
    """A material from a measurement, which is fitted, or from a parameter file, which is loaded.

    The content decides, not the suffix. `encoding` is that of `readers.read`, the other options
    are those of `fit.fit_steps`.

    Raises
    ------
    MeasurementError, ParameterFileError
        The file cannot be used.
    """
    if is_parameter_file(path):
        return parameter_file.load(path)
    return fit_measurement(
        readers.read(path, encoding=encoding),
        weight=weight,
        quality=quality,
        prior_strength=prior_strength,
        on_step=on_step,
    )


def is_parameter_file(path: str | os.PathLike) -> bool:
    """Whether a file starts like JSON; a measurement never does."""
    try:
        if not Path(path).is_file():
            # a missing file is reported by the reader that its name asks for
            return os.fsdecode(path).endswith(".json")
        with Path(path).open("rb") as file:
            return file.read(64).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
    except (OSError, ValueError):
        return False


def fit_measurement(
    measurement: AnyMeasurement,
    *,
    weight: str = DEFAULT_WEIGHT,
    quality: str = DEFAULT_QUALITY,
    prior_strength: float = DEFAULT_STRENGTH,
    on_step: OnStep | None = None,
    graded: bool = True,
) -> FittedMaterial:
    """Fit and grade; on_step sees every step of the fit and may raise to stop it.

    graded : False leaves out the figures that take longer than a draft may
    """
    anisotropic = isinstance(measurement, AnisotropicMeasurement)
    fit_steps = anisotropic_fit.fit_steps if anisotropic else fit.fit_steps
    iterations = 0
    for step in fit_steps(
        measurement, weight=weight, quality=quality, prior_strength=prior_strength
    ):
        iterations += 1
        if on_step:
            on_step(step)
    result = fit.result_of(step, iterations, weight)
    figures = _anisotropic_figures if anisotropic else _isotropic_figures
    return FittedMaterial(
        name=material_name(measurement.source.file_name),
        model=result.model,
        source=measurement.source,
        fit={
            "objective": result.objective,
            "iterations": result.iterations,
            "weight": result.weight,
            "quality": quality,
            "prior_strength": prior_strength,
            "bins_usable": measurement.report.usable,
            "bins_negative": measurement.report.negative,
            "bins_not_finite": measurement.report.non_finite,
            **(figures(result.model, measurement) if graded else {}),
        },
    )


def _isotropic_figures(
    model: FactorModel, measurement: Measurement
) -> dict[str, float | int | str]:
    report = measurement.report
    return {
        "studio_psnr": studio_psnr(model, measurement),
        "mean_log_error": metrics.mean_log_error(metrics.tabulate(model), measurement),
        "largest_directional_albedo": tables.largest_directional_albedo(model),
        "bins_below_horizon": report.below_horizon,
        **({"bins_clamped": report.clamped} if report.clamped else {}),
    }


def _anisotropic_figures(
    model: AnisotropicModel, measurement: AnisotropicMeasurement
) -> dict[str, float | int | str]:
    table = anisotropic_metrics.tabulate(model)
    main = anisotropy(model)
    return {
        "mean_log_error": anisotropic_metrics.mean_log_error(table, measurement),
        "numeric_psnr": metrics.numeric_psnr(table, measurement),
        "largest_directional_albedo": anisotropic_albedo.largest_directional_albedo(model),
        "anisotropy_direction": main.direction,
        "anisotropy_strength": main.strength,
        "encoding": measurement.encoding,
    }


def material_name(file_name: str) -> str:
    """Name for a material from that of a file: no suffixes, nothing that does not print."""
    stem = shown_name(file_name)
    for suffix in (parameter_file.SUFFIX, Path(stem).suffix):
        if suffix and stem.lower().endswith(suffix.lower()) and len(stem) > len(suffix):
            stem = stem[: -len(suffix)]
            break
    return stem[:60] or "material"
