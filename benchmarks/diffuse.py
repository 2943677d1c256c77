# SPDX-License-Identifier: GPL-3.0-or-later
"""Experiment: an energy-compensating diffuse part instead of Lambert's.

Peng et al. 2017, section 4, name the diffuse part of Ashikhmin and Shirley 2000 as future work:

    d b(theta_i) b(theta_o),    b(theta) = 1 - (1 - cos(theta) / 2)^5,  here with b(0) = 1

(their factor 1 - R_s is part of the free d). Since b is a product, f / (b b) is a model of our form
whose G is divided by b; so the data is divided, the weights and the basis of G adapted, and nothing
else changes. Scene and PSNR are those of ./nfm bench fit, both models have as many numbers and the
same fit.
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace

import numpy as np

from fitter.fitting import fit, weights
from fitter.fitting.appearance import AppearanceError
from fitter.fitting.problem import Problem
from fitter.fitting.quality import DEFAULT_QUALITY, QUALITIES
from fitter.geometry import HALF_PI, merl_bins
from fitter.grading.metrics import tabulate
from fitter.measurement import Measurement
from fitter.models.model import FactorModel

from . import experiment

WEIGHT = f"ashikhmin {weights.DEFAULT_WEIGHT}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench diffuse."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(experiment.MATERIALS))
    parser.add_argument("--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY)


def run(arguments: argparse.Namespace) -> int:
    """Fit both, grade and print."""
    materials = experiment.materials(arguments.materials.split(","))
    weights.WEIGHTS[WEIGHT] = weight
    gains = []
    print(f"{'material':<28}{'Lambert':>9}{'Ashikhmin':>11}{'gain dB':>9}{'E ratio':>9}")
    for name, measurement, psnr_of in materials:
        lambert = fit.fit(measurement, quality=arguments.quality)
        ashikhmin = fit.fit(
            divided(measurement),
            weight=WEIGHT,
            quality=arguments.quality,
            make_problem=ashikhmin_problem,
            make_appearance=ashikhmin_appearance,
        )
        psnr = [psnr_of(tabulate(lambert.model)), psnr_of(ashikhmin_table(ashikhmin.model))]
        gains.append(psnr[1] - psnr[0])
        print(
            f"{name:<28}{psnr[0]:9.2f}{psnr[1]:11.2f}{gains[-1]:9.2f}"
            f"{ashikhmin.objective / lambert.objective:9.2f}",
            flush=True,
        )
    print(f"gain: mean {statistics.mean(gains):.2f} dB, {min(gains):.2f} to {max(gains):.2f} dB")
    return 0


def falloff(cosine: np.ndarray) -> np.ndarray:
    """The b of the module's description, 1 at normal incidence, 0 at grazing."""
    return (1 - (1 - cosine / 2) ** 5) / (1 - 0.5**5)


def _of_pair(cos_i: np.ndarray, cos_o: np.ndarray) -> np.ndarray:
    return falloff(cos_i) * falloff(cos_o)


def divided(measurement: Measurement) -> Measurement:
    """The measurement over b(theta_i) b(theta_o)."""
    return replace(measurement, f_r=measurement.f_r / _of_measured_pairs(measurement)[..., None])


def _of_measured_pairs(measurement: Measurement) -> np.ndarray:
    """b(theta_i) b(theta_o) of all bins (90, 90, 180), 1 where nothing was measured."""
    bins = merl_bins()
    return np.where(measurement.valid, _of_pair(bins.cos_i, bins.cos_o), 1)


def weight(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray, level: float) -> np.ndarray:
    """The default weight of the values before the division, for squared errors after it."""
    pair = _of_pair(cos_i, cos_o)
    return pair**2 * weights.WEIGHTS[weights.DEFAULT_WEIGHT](f_r * pair, cos_i, cos_o, level)


def ashikhmin_problem(measurement: Measurement, **options: object) -> Problem:
    """Problem of a divided measurement: G over cos theta becomes G over b cos theta."""
    problem = Problem(measurement, **options)
    theta = (np.arange(problem.n_angles) + 0.5) / problem.n_angles * HALF_PI
    problem.basis = problem.basis / falloff(np.cos(theta))[:, None]
    return problem


def ashikhmin_appearance(measurement: Measurement, n_maps: int) -> AppearanceError:
    """The appearance of the values before the division; lobes stand in it as they are."""
    pair = _of_measured_pairs(measurement)
    undivided = replace(measurement, f_r=measurement.f_r * pair[..., None])
    return AppearanceError.of(undivided, n_maps, diffuse_shape=pair)


def ashikhmin_table(model: FactorModel) -> np.ndarray:
    """f_r (90, 90, 180, 3) of a fit by ashikhmin_problem."""
    bins = merl_bins()
    lobes = tabulate(replace(model, diffuse=np.zeros(3)))
    pair = np.where(bins.above_horizon, _of_pair(bins.cos_i, bins.cos_o), 0)
    return lobes + model.diffuse * pair[..., None]
