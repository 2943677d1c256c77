# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist would do without a measurement, to compare with: Lambert plus one GGX lobe.

    f_c(wi, wo) = d_c + F_c(theta_d) D(theta_h) G2(theta_i, theta_o) / (4 cos theta_i cos theta_o)
    F_c = f0_c + (f90_c - f0_c) (1 - cos theta_d)^5                              (Schlick 1994)

with the GGX distribution (Walter et al. 2007) and height-correlated Smith masking (Heitz 2014), as
Cycles has them: colours for the base, the highlight and its edge, and one roughness. 3 + 3 + 3 + 1
= 10 numbers. Schlick's f90 is 1; here it is free, because with 1 the lobe of a metal whose data
does not rise to 1 at grazing angles comes out far too wide or black.

For a given alpha the model is linear in the colours, and their best values are solved for. What is
left is a function of alpha, whose valley is found on a grid and then by golden-section search.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fitting.problem import Problem
from ..fitting.weights import DEFAULT_WEIGHT
from ..geometry import HALF_PI, half_angles, theta_d_centres, theta_h_centres
from ..line_search import least_around_nodes
from ..measurement import Measurement
from ..nnls import solve_nonnegative

# Range of alpha = roughness^2. Below the smallest, D is narrower than the MERL grid can show.
ALPHAS = np.geomspace(1e-3, 1, 25)

PHI_GROUP = 3
N_ANGLES = 720


@dataclass(frozen=True)
class Principled:
    """The model.

    diffuse : (3,) d_c, 1/sr
    f0, f90 : (3,) reflectance of a facet seen head-on and at grazing angles, 0..1
    alpha : width of D; the roughness of the node is its square root
    """

    diffuse: np.ndarray
    f0: np.ndarray
    f90: np.ndarray
    alpha: float

    @property
    def n_parameters(self) -> int:
        """Count of numbers, 10."""
        return self.diffuse.size + self.f0.size + self.f90.size + 1

    def f_r(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """BRDF (n, 3), 1/sr, for unit directions wi, wo (n, 3); 0 below the horizon."""
        wi, wo = np.asarray(wi, dtype=np.float64), np.asarray(wo, dtype=np.float64)
        theta_h, theta_d = half_angles(wi, wo)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        cos_i, cos_o = (np.where(above, w[:, 2], 1) for w in (wi, wo))
        lobe = ndf(theta_h, self.alpha) * visibility(cos_i, cos_o, self.alpha)
        fresnel = self.f0 + (self.f90 - self.f0) * schlick_rise(theta_d)[:, None]
        return np.where(above[:, None], self.diffuse + fresnel * lobe[:, None], 0)


def fit(measurement: Measurement, *, weight: str = DEFAULT_WEIGHT) -> Principled:
    """The best of all alphas, with the best colours for each."""
    problem = Problem(measurement, weight=weight, phi_group=PHI_GROUP, n_angles=N_ANGLES)

    def error(log_alpha: float) -> float:
        return _solved(problem, np.exp(log_alpha))[0]

    return _solved(problem, np.exp(least_around_nodes(error, np.log(ALPHAS))))[1]


def ndf(theta_h: np.ndarray, alpha: float) -> np.ndarray:
    """GGX distribution of the half vector, 1/sr."""
    # written with the sine: 1 - cos^2 has no digits left where D is sharpest
    return alpha**2 / (np.pi * (alpha**2 + (1 - alpha**2) * np.sin(theta_h) ** 2) ** 2)


def visibility(cos_i: np.ndarray, cos_o: np.ndarray, alpha: float) -> np.ndarray:
    """Height-correlated Smith G2 / (4 cos_i cos_o); cosines in (0, 1]."""

    def slope(cosine: np.ndarray) -> np.ndarray:
        return np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2)

    return 0.5 / (cos_o * slope(cos_i) + cos_i * slope(cos_o))


def schlick_rise(theta_d: np.ndarray) -> np.ndarray:
    """(1 - cos theta_d)^5, from 0 head-on to 1 at grazing angles."""
    return (1 - np.cos(theta_d)) ** 5


def _solved(problem: Problem, alpha: float) -> tuple[float, Principled]:
    """Squared error, less a constant, and the model of the best d >= 0 and f0, f90 in 0..1."""
    cosines = np.cos((np.arange(N_ANGLES) + 0.5) / N_ANGLES * HALF_PI)
    kernel = visibility(cosines[problem.bin_i], cosines[problem.bin_o], alpha)
    moments = problem.moments(kernel[None])
    kernel_kernel = moments.kernel_kernel[:, :, 0, 0]
    kernel_target, kernel_sum = moments.kernel_target[:, :, 0], moments.kernel[:, :, 0]

    # f = d + (f0 amplitude_0 + f90 amplitude_90) K
    rise = schlick_rise(theta_d_centres())
    amplitude = ndf(theta_h_centres(), alpha)[:, None, None] * np.stack([1 - rise, rise], -1)
    matrix, right = np.empty((3, 3, 3)), np.empty((3, 3))
    matrix[:, 0, 0] = problem.cell_weight.sum((0, 1))
    matrix[:, 0, 1:] = matrix[:, 1:, 0] = np.einsum("hda,hdc->ca", amplitude, kernel_sum)
    matrix[:, 1:, 1:] = np.einsum(
        "hda,hdc,hdb->cab", amplitude, kernel_kernel, amplitude, optimize=True
    )
    right[:, 0] = problem.cell_target.sum((0, 1))
    right[:, 1:] = np.einsum("hda,hdc->ca", amplitude, kernel_target)
    x, error = _solve_bounded(matrix, right)
    return float(error.sum()), Principled(x[:, 0], x[:, 1], x[:, 2], float(alpha))


def _solve_bounded(matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Minimise x' A x - 2 b' x over x >= 0, all but the first at most 1; also the minima.

    matrix (n, 3, 3), right (n, 3). Which of the two are at 1 is tried out.
    """
    best, least = np.zeros_like(right), np.full(len(right), np.inf)
    for at_one in ([], [1], [2], [1, 2]):
        free = [k for k in range(3) if k not in at_one]
        x = np.ones_like(right)
        remaining = right[:, free] - matrix[:, free][:, :, at_one].sum(-1)
        x[:, free] = solve_nonnegative(matrix[:, free][:, :, free], remaining)
        value = np.einsum("ni,nij,nj->n", x, matrix, x) - 2 * (right * x).sum(-1)
        better = (x[:, 1:] <= 1).all(-1) & (value < least)
        best[better], least[better] = x[better], value[better]
    return best, least
