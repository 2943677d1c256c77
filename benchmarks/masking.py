# SPDX-License-Identifier: GPL-3.0-or-later
"""Experiment: a height-correlated masking term instead of G(theta_i) G(theta_o).

Peng et al. 2017, section 4, name a more accurate G2 as future work. With Lambda = 1 / G - 1,

    G2(i, o) = 1 / (1 + Lambda(theta_i) + Lambda(theta_o))              (Heitz 2014, eq. 99)

has as many numbers as the product. Two forms are compared with the product:

- correlated: that G2 for every lobe;
- tables: every lobe has a free symmetric table over (theta_i, theta_o) in place of the correlation,
  3 x 465 numbers more, which contains all forms: about the most that any G2 could gain.

Both start from the finished fit. In each round d, s, D and F take their exact best values, then
Lambda moves by Gauss-Newton steps, or the tables take their best values; no step raises the error.
What is missing beside the fit of the product are its joint steps. Scene and PSNR are those of
./nfm bench fit.
"""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path

import numpy as np

from fitter.fitting.problem import Problem, amplitudes
from fitter.fitting.updates import (
    masking_normal_equations,
    update_diffuse_and_scale,
    update_fresnel,
    update_ndf,
)
from fitter.geometry import HALF_PI, merl_bins
from fitter.grading.metrics import tabulate
from fitter.models.model import FactorModel
from fitter.nnls import solve_nonnegative

from . import experiment, shared_data

N_ANGLES = 180  # angle bins of samples and pictures
N_TABLE = 30  # bins of theta in the tables: 3 degrees
N_LAMBDA = 46  # nodes of Lambda: 2 degrees
ROUNDS = 40
STEPS = 2  # of Gauss-Newton in a round
# G from 0.01 to 0.9999: what Lambda may be.
LAMBDA_RANGE = (1e-4, 99.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench masking."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(experiment.MATERIALS))
    parser.add_argument("--fits", type=Path, metavar="DIR", help="keeps fits, and uses them")


def run(arguments: argparse.Namespace) -> int:
    """Grade the three forms and print."""
    materials = experiment.materials(arguments.materials.split(","))
    gains = []
    print(f"{'material':<28}{'product':>9}{'correlated':>12}{'tables':>9}{'E ratios':>15}")
    for name, measurement, psnr_of in materials:
        model = shared_data.fitted_material(name, arguments.fits).model
        problem = Problem(measurement, phi_group=5, n_angles=N_ANGLES)
        start = problem.objective_of(model)
        tables, ratios = [tabulate(model)], []
        for form in (HeightCorrelated(model), Tables(problem, model)):
            better, objective = improved(problem, model, form)
            tables.append(table_of(better, form.pairs()))
            ratios.append(objective / start)
        psnr = [psnr_of(table) for table in tables]
        gains.append([value - psnr[0] for value in psnr[1:]])
        print(
            f"{name:<28}{psnr[0]:9.2f}{psnr[1]:12.2f}{psnr[2]:9.2f}"
            f"{ratios[0]:9.2f}{ratios[1]:6.2f}",
            flush=True,
        )
    for form, values in zip(("correlated", "tables"), zip(*gains, strict=True), strict=True):
        spread = f"{min(values):.2f} to {max(values):.2f} dB"
        print(f"gain of {form}: mean {statistics.mean(values):.2f} dB, {spread}")
    return 0


class HeightCorrelated:
    """G2 of the module's description, with log Lambda linear between N_LAMBDA nodes."""

    def __init__(self, model: FactorModel) -> None:
        theta = np.linspace(0, HALF_PI, N_LAMBDA)
        masking = np.maximum(model.evaluate_masking(theta), 1 / (1 + LAMBDA_RANGE[1]))
        self._log = np.log(np.clip(1 / masking - 1, *LAMBDA_RANGE))
        position = _angles() / HALF_PI * (N_LAMBDA - 1)
        self._nodes = np.maximum(1 - np.abs(position[:, None] - np.arange(N_LAMBDA)), 0)

    def pairs(self) -> np.ndarray:
        """G2 / (cos cos) of pairs of angle bins, (lobes, n, n)."""
        return np.stack([self._correlation(row)[1] for row in self._log])

    def improve(self, problem: Problem, model: FactorModel) -> None:
        """Gauss-Newton steps on the Lambda of each lobe, the others held."""
        for lobe in range(model.n_lobes):
            kernels = _kernels(problem, self.pairs())
            square, right = masking_normal_equations(problem, kernels, model, lobe)
            for _ in range(STEPS):
                self._log[lobe] = self._stepped(self._log[lobe], square, right)

    def _correlation(self, log: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """1 / (1 + Lambda_i + Lambda_o), and the same over the cosines."""
        masking = 1 / (1 + np.add.outer(*[np.exp(self._nodes @ log)] * 2))
        cosine = np.cos(_angles())
        return masking, masking / np.multiply.outer(cosine, cosine)

    def _stepped(self, log: np.ndarray, square: np.ndarray, right: np.ndarray) -> np.ndarray:
        """After one step that lowers square K^2 / 2 - right K, or as it was."""

        def error(trial: np.ndarray) -> float:
            pairs = self._correlation(trial)[1]
            return float((square * pairs**2 / 2 - right * pairs).sum())

        masking, pairs = self._correlation(log)
        slope = pairs * masking  # -dK / dLambda, the same at either end
        chain = np.exp(self._nodes @ log)[:, None] * self._nodes
        gradient = -2 * chain.T @ ((square * pairs - right) * slope).sum(1)
        curvature = square * slope**2
        normal = 2 * chain.T @ (np.diag(curvature.sum(1)) + curvature) @ chain
        normal[np.diag_indices(N_LAMBDA)] += 1e-6 * np.diag(normal).max()
        step, before = -np.linalg.solve(normal, gradient), error(log)
        for share in (1.0, 0.3, 0.1, 0.03):
            trial = np.clip(log + share * np.clip(step, -1, 1), *np.log(LAMBDA_RANGE))
            if error(trial) < before:
                return trial
        return log


class Tables:
    """The product times a free symmetric table for every lobe."""

    def __init__(self, problem: Problem, model: FactorModel) -> None:
        u = model.masking @ problem.basis.T
        self._product = u[:, :, None] * u[:, None, :]
        self._table = np.ones((model.n_lobes, N_TABLE, N_TABLE))

    def pairs(self) -> np.ndarray:
        """G2 / (cos cos) of pairs of angle bins, (lobes, n, n)."""
        width = N_ANGLES // N_TABLE
        return self._product * self._table.repeat(width, 1).repeat(width, 2)

    def improve(self, problem: Problem, model: FactorModel) -> None:
        """Set the tables of all lobes to their exact best values."""
        n_lobes = model.n_lobes
        a = amplitudes(model).reshape(-1, n_lobes, 3)
        values = a.swapaxes(0, 1)[:, :, None] * _kernels(problem, self._product)[..., None]
        residual = problem.weighted_target - problem.weight * model.diffuse
        right = np.empty((N_TABLE, N_TABLE, n_lobes))
        matrix = np.empty((N_TABLE, N_TABLE, n_lobes, n_lobes))
        for m in range(n_lobes):
            right[..., m] = _coarse(problem, (residual * values[m]).sum(-1))
            for k in range(m, n_lobes):
                product = (problem.weight * values[m] * values[k]).sum(-1)
                matrix[..., m, k] = matrix[..., k, m] = _coarse(problem, product)
        solution = solve_nonnegative(
            matrix.reshape(-1, n_lobes, n_lobes), right.reshape(-1, n_lobes)
        ).reshape(right.shape)
        seen = np.einsum("iomm->iom", matrix) > 0
        self._table = np.moveaxis(np.where(seen, solution, 1), -1, 0)


def improved(
    problem: Problem, model: FactorModel, form: HeightCorrelated | Tables
) -> tuple[FactorModel, float]:
    """Model and objective after rounds of updates; its masking is not used, form's is."""
    for _ in range(ROUNDS):
        moments = problem.moments(_kernels(problem, form.pairs()))
        for update in (update_diffuse_and_scale, update_ndf, update_fresnel):
            model = update(problem, moments, model)
        form.improve(problem, model)
    moments = problem.moments(_kernels(problem, form.pairs()))
    return model, problem.objective(model, moments)


def table_of(model: FactorModel, pairs: np.ndarray) -> np.ndarray:
    """f_r (90, 90, 180, 3) of a model with another masking, (lobes, n, n) over the cosines."""
    bins = merl_bins()
    row, column = (
        np.minimum((np.arccos(np.clip(c, 0, 1)) / HALF_PI * N_ANGLES).astype(int), N_ANGLES - 1)
        for c in (bins.cos_i, bins.cos_o)
    )
    lobes = amplitudes(model)
    f_r = sum(lobes[:, :, None, m] * pairs[m][row, column][..., None] for m in range(len(pairs)))
    return np.where(bins.above_horizon[..., None], f_r + model.diffuse, 0)


def _angles() -> np.ndarray:
    """Middles of the angle bins, radians."""
    return (np.arange(N_ANGLES) + 0.5) / N_ANGLES * HALF_PI


def _kernels(problem: Problem, pairs: np.ndarray) -> np.ndarray:
    """G2 / (cos cos) of every sample, (lobes, 8100, n_phi)."""
    return pairs[:, problem.bin_i, problem.bin_o]


def _coarse(problem: Problem, values: np.ndarray) -> np.ndarray:
    """Samples summed by coarse pairs of angle bins, both orders together: (30, 30)."""
    width = N_ANGLES // N_TABLE
    coarse = problem.pair_table(values).reshape(N_TABLE, width, N_TABLE, width).sum((1, 3))
    return coarse + coarse.T
