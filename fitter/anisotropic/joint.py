# SPDX-License-Identifier: GPL-3.0-or-later
"""The normal equations of the anisotropic model for the joint steps of `joint`.

Every derivative of f is a number per sample and channel times an interpolation: a block of J' W J
is one call of AnisotropicProblem.product_sums.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import polar_grid
from ..fitting.joint import Equations, Layout
from ..models.anisotropic_model import AnisotropicModel
from ..taps import Taps
from . import coarse
from .problem import AnisotropicProblem


@dataclass(frozen=True)
class _Group:
    """Parameters whose derivatives have a common form: df_c(j) / dx_k = amplitude_c(j) tap_k(j).

    part : where they stand in the parameter vector
    channels : those that they touch
    amplitude : (channels, n)
    chain : (size,) derivative of the number that is interpolated to its logarithm, or 1
    spread : (size, parameters) derivative of these to the parameters; None if they are the same
    """

    part: slice
    taps: Taps
    channels: slice
    amplitude: np.ndarray
    chain: np.ndarray
    spread: np.ndarray | None = None

    def spread_over(self, values: np.ndarray) -> np.ndarray:
        """Derivatives to the numbers (size, ...) as those to the parameters."""
        values = (values.T * self.chain).T
        return values if self.spread is None else self.spread.T @ values


def normal_equations(
    problem: AnisotropicProblem, model: AnisotropicModel, layout: Layout
) -> Equations:
    """Equations of the anisotropic model; see joint.refine."""
    normal = np.zeros((layout.size, layout.size))
    gradient = np.zeros(layout.size)
    groups = list(_groups(problem, model, layout))
    f = model.diffuse[:, None] + problem.lobe_values(model).sum(0)
    residual = problem.weighted_target - problem.weight * f
    for number, a in enumerate(groups):
        pulled = (a.amplitude * residual[a.channels]).sum(0)
        gradient[a.part] = a.spread_over(a.taps.gathered(pulled))
        for b in groups[number:]:
            coupling = _coupling(problem.weight, a, b)
            if coupling is not None:
                block = problem.product_sums(a.taps, b.taps, coupling)
                block = b.spread_over(a.spread_over(block).T).T
                normal[a.part, b.part] = block
                normal[b.part, a.part] = block.T
    value = problem.target_energy - ((problem.weighted_target + residual) * f).sum()
    return float(value / problem.target_energy), normal, gradient


def _groups(
    problem: AnisotropicProblem, model: AnisotropicModel, layout: Layout
) -> Iterator[_Group]:
    is_coarse = isinstance(model, coarse.CoarseModel)
    n_free = coarse.N_FREE if is_coarse else polar_grid.N_FREE
    spread = coarse.spread() if is_coarse else None
    ndf = polar_grid.free_numbers(model.ndf)
    kernels = problem.kernels(model.masking)
    fresnel = problem.fresnel(model)
    values = problem.lobe_values(model)
    level = problem.ndf(model) * kernels  # without scale and F
    every, number = slice(0, 3), np.ones(1)
    for m in range(model.n_lobes):
        part = _part(layout.ndf, m, n_free)
        amplitude = model.scale[m][:, None] * fresnel * kernels[m]
        yield _Group(part, problem.half, every, amplitude, ndf[m], spread)
    for m in range(model.n_lobes):
        part = _part(layout.masking, m, n_free)
        yield _Group(part, problem.nodes, every, values[m], np.ones(polar_grid.N_FREE), spread)
    for c in range(3):
        channel = slice(c, c + 1)
        amplitude = (model.scale[:, c] @ level)[None]
        part = _part(layout.fresnel, c, model.fresnel.shape[1])
        yield _Group(part, problem.difference, channel, amplitude, model.fresnel[c])
        for m in range(model.n_lobes):
            part = _part(layout.scale, 3 * m + c, 1)
            yield _Group(part, problem.one, channel, values[m, channel], number)
        amplitude = np.ones_like(values[0, channel])
        yield _Group(_part(layout.diffuse, c, 1), problem.one, channel, amplitude, number)


def _part(factor: slice, row: int, size: int) -> slice:
    return slice(factor.start + row * size, factor.start + (row + 1) * size)


def _coupling(weight: np.ndarray, a: _Group, b: _Group) -> np.ndarray | None:
    """Sum over common channels of w times both amplitudes (n,); None without a common channel."""
    start, stop = max(a.channels.start, b.channels.start), min(a.channels.stop, b.channels.stop)
    if start >= stop:
        return None
    return sum(
        weight[c] * a.amplitude[c - a.channels.start] * b.amplitude[c - b.channels.start]
        for c in range(start, stop)
    )
