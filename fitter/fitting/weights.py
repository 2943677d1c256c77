# SPDX-License-Identifier: GPL-3.0-or-later
"""Compressive weights of the fitting objective (Peng et al. 2017, eq. 2).

The raw BRDF spans six decades between peak and diffuse floor. Weighting the squared error by the
squared derivative of a compressive curve c(x) at the measured value makes it, to first order, the
squared error of c: sum w (f - rho)^2 ~ sum (c(f) - c(rho))^2. Peng et al. 2017 keep the formula
of Bagher et al. 2016 without printing it; docs/RESULTS.md compares these.

`sample_weights` multiplies by the measure of the bin and averages f_r over wi <-> wo first: a
weight that looked at each value alone would be smaller where noise is positive, and pull the fit
below the mean. Values: f_r in 1/sr; cos_i, cos_o in (0, 1]; level, the mean of f_r over all pairs
of directions weighted by cos_i cos_o, in 1/sr.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..geometry import merl_bins, merl_solid_angle
from ..measurement import Measurement

DISPLAY_GAMMA = 2.2

# Where the display curve turns linear, as a share of the mean level: a picture is exposed by its
# mean, so what is black in it depends on the material. It keeps the weight of black bins finite.
BLACK_SHARE = 0.05


def display_gamma(
    f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray, level: float
) -> np.ndarray:
    """Derivative of x^(1/2.2), what a display does, at x = f_r cos_i cos_o."""
    cosines = cos_i * cos_o
    return cosines**2 / (f_r * cosines + BLACK_SHARE * level) ** (2 * (1 - 1 / DISPLAY_GAMMA))


def logarithm(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray, level: float) -> np.ndarray:
    """Derivative of log(x + 0.1) at x = f_r cos_i cos_o: relative error, dark bins included."""
    cosines = cos_i * cos_o
    return (cosines / (f_r * cosines + 0.1)) ** 2


def log1p(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray, level: float) -> np.ndarray:
    """Derivative of log(1 + x) at x = f_r cos_i cos_o."""
    cosines = cos_i * cos_o
    return (cosines / (1 + f_r * cosines)) ** 2


def linear(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray, level: float) -> np.ndarray:
    """No compression: the squared error of f_r cos_i cos_o."""
    return np.broadcast_to((cos_i * cos_o) ** 2, f_r.shape)


WEIGHTS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray, float], np.ndarray]] = {
    "display-gamma": display_gamma,
    "log": logarithm,
    "log1p": log1p,
    "linear": linear,
}
DEFAULT_WEIGHT = "display-gamma"


def sample_weights(measurement: Measurement, weight: str) -> Iterator[np.ndarray]:
    """w_j of eq. 2 for the bins of each channel in turn: (90, 90, 180), 0 where not valid.

    weight : a name in WEIGHTS
    """
    bins = merl_bins()
    valid = measurement.valid & bins.above_horizon
    cos_i, cos_o = np.where(valid, bins.cos_i, 1), np.where(valid, bins.cos_o, 1)
    measure = np.where(valid, merl_solid_angle()[:, :, None], 0)
    projected = measure * cos_i * cos_o
    level = float(np.einsum("hdpc,hdp->", measurement.f_r, projected) / (3 * projected.sum()))
    paired = valid & valid[:, :, ::-1]
    for channel in range(3):
        rho = measurement.f_r[..., channel]
        mean = np.where(paired, (rho + rho[:, :, ::-1]) / 2, rho)
        yield measure * WEIGHTS[weight](mean, cos_i, cos_o, level)
