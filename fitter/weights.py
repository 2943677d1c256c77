# SPDX-License-Identifier: GPL-3.0-or-later
"""Compressive weights of the fitting objective (Peng et al. 2017, eq. 2).

The raw BRDF spans six decades between peak and diffuse floor. Weighting the squared error by the
squared derivative of a compressive curve c(x) at the measured value makes it, to first order, the
squared error of c: sum w (f - rho)^2 ~ sum (c(f) - c(rho))^2. Peng et al. 2017 keep the formula
of Bagher et al. 2016 without printing it; docs/RESULTS.md compares these.

`problem` multiplies by the measure of the bin. Values: f_r in 1/sr; cos_i, cos_o in (0, 1].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

DISPLAY_GAMMA = 2.2

# Where the display curve turns linear, as reflected radiance under unit illumination (1/sr). It
# keeps the weight of black bins finite.
BLACK_LEVEL = 0.01


def display_gamma(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray) -> np.ndarray:
    """Derivative of x^(1/2.2), what a display does, at x = f_r cos_i cos_o."""
    cosines = cos_i * cos_o
    return cosines**2 / (f_r * cosines + BLACK_LEVEL) ** (2 * (1 - 1 / DISPLAY_GAMMA))


def logarithm(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray) -> np.ndarray:
    """Derivative of log(x + 0.1) at x = f_r cos_i cos_o: relative error, dark bins included."""
    cosines = cos_i * cos_o
    return (cosines / (f_r * cosines + 0.1)) ** 2


def log1p(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray) -> np.ndarray:
    """Derivative of log(1 + x) at x = f_r cos_i cos_o."""
    cosines = cos_i * cos_o
    return (cosines / (1 + f_r * cosines)) ** 2


def linear(f_r: np.ndarray, cos_i: np.ndarray, cos_o: np.ndarray) -> np.ndarray:
    """No compression: the squared error of f_r cos_i cos_o."""
    return np.broadcast_to((cos_i * cos_o) ** 2, f_r.shape)


WEIGHTS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "display-gamma": display_gamma,
    "log": logarithm,
    "log1p": log1p,
    "linear": linear,
}
DEFAULT_WEIGHT = "display-gamma"
