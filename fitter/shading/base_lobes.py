# SPDX-License-Identifier: GPL-3.0-or-later
"""The base: each lobe of a model as a mixture of closures that Cycles can evaluate.

A shader never sees the light direction, so a renderer can sample lights for a material only through
closures of its own. For every lobe and view direction the lobe is written as a sum of a few of them
(closures.py), whose weights stand in a table over the view directions of `view_grid.py` and are
interpolated linearly.

One set of closures serves all lobes and views, since that is what costs time per sample. It is
picked for the material from a catalogue by `select_closures`; the weights are least squares
with the compressive weight 1 / (f cos + small), non-negative for microfacet closures and free for
ramps. Every lobe is fitted for itself and, with the larger weight, as its part of the sum: the
sum is what an untouched material shows, the single lobes are what an artist scales.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..models.factors import Factors, PairTaps
from ..nnls import PartlyNonnegative
from ..quadrature import ViewQuadrature
from .base_catalogue import catalogue, draft_closures
from .closures import Closure
from .view_grid import DRAFT_GRIDS, FIT_GRIDS, SELECTION_GRIDS, ViewGrid

N_CLOSURES = 10

# Keeps the weight finite where nothing is reflected: this share of the mean value.
WEIGHT_FLOOR = 0.02
# Tikhonov term on columns of unit norm. Without it the weights of neighbouring view angles differ
# wildly, and interpolation between them is wrong.
RIDGE = 1e-2
# Columns that hold less than this share of their closure's largest are not scaled up to unit norm:
# F90 near normal incidence, say, where nothing determines it and Cycles would pick by it.
LEAST_NORM = 0.1
# Weight of a lobe's own residual beside that of the sum.
OWN_SHARE = 0.3
SWEEPS = 4
# Numbers of a dictionary that is kept for the next model: 60 MB, of which Blender would hold four.
# That of a finished anisotropic base has 340.
MOST_KEPT = 8e6


@dataclass(frozen=True)
class BaseLobes:
    """Weights of closures over the view direction, with the model's own scales in them.

    closures : the dictionary, in the order of the columns
    theta_o : (rows,) radians
    weights : (rows, azimuths, lobes, 3, columns), azimuths evenly from 0; microfacet columns are
        >= 0
    picking : (rows, azimuths, lobes, closures) how much Cycles shall pick each ramp closure, as a
        share of light like an albedo; 0 for microfacet closures, which are picked by their weight
    """

    closures: tuple[Closure, ...]
    theta_o: np.ndarray
    weights: np.ndarray
    picking: np.ndarray

    def value(self, wi: np.ndarray, wo: np.ndarray, tints: np.ndarray | None = None) -> np.ndarray:
        """Value f cos(theta_i) of the specular sum (n, 3), 1/sr, for wi (n, 3) and one wo (3,).

        tints : (lobes, 3) factors of the lobes; None is 1
        """
        weights = self.weights_at(wo)
        if tints is not None:
            weights = weights * tints[:, :, None]
        columns = np.concatenate([closure.columns(wi, wo) for closure in self.closures])
        return (weights.sum(0) @ columns).T

    def weights_at(self, wo: np.ndarray) -> np.ndarray:
        """Weights (lobes, 3, columns) at a unit wo (3,), linear between the nodes."""
        theta_o = float(np.arctan2(np.hypot(wo[0], wo[1]), wo[2]))
        nodes = self.theta_o
        upper = int(np.clip(np.searchsorted(nodes, theta_o) - 1, 0, len(nodes) - 2))
        t = float(np.clip((theta_o - nodes[upper]) / (nodes[upper + 1] - nodes[upper]), 0, 1))
        azimuths = self.weights.shape[1]
        column = float(np.arctan2(wo[1], wo[0])) / (2 * np.pi) * azimuths
        left = int(np.floor(column))
        s = column - left
        rows = self.weights[upper] * (1 - t) + self.weights[upper + 1] * t
        return rows[left % azimuths] * (1 - s) + rows[(left + 1) % azimuths] * s


def fit_base_lobes(
    model: Factors, closures: Sequence[Closure] | None = None, *, draft: bool = False
) -> BaseLobes:
    """Base of a model.

    closures : dictionary to use, for instance that of the model before an edit, which saves the
        selection; None selects N_CLOSURES of the catalogue
    draft : with fewer views, where there are many, and where the selection would take long, with
        closures that do for most materials
    """
    closures = closures or (draft and draft_closures(model)) or select_closures(model, N_CLOSURES)
    closures = tuple(closures)
    grid = (DRAFT_GRIDS if draft else FIT_GRIDS)[model.kind]
    systems = _systems(model, closures, grid, again=draft)
    weights = _solve_lobes(systems, ~_signed_columns(closures))
    picking = _picking(systems, closures, weights, grid)
    return BaseLobes(closures, np.array(grid.theta_o), grid.table(weights), grid.table(picking))


def select_closures(model: Factors, count: int) -> tuple[Closure, ...]:
    """The `count` closures of the catalogue that together follow the sum of the lobes best.

    Forward selection: at each step the closure that would lower the squared residual most, with
    those already chosen free to adapt, summed over views and channels.
    """
    candidates, grid = catalogue(model), SELECTION_GRIDS[model.kind]
    signed = _signed_columns(candidates)
    owner = _owner(candidates)
    systems = _systems(model, candidates, grid)
    chosen: list[int] = []
    solutions = np.zeros((len(systems), 3, len(owner)))
    while len(chosen) < count:
        gains = np.zeros(len(candidates))
        for system, solution, area in zip(systems, solutions, grid.areas(), strict=True):
            free = np.isin(owner, chosen) & (signed | (solution != 0).any(0))
            gains += area * _gains(system, solution, free, candidates)
        gains[chosen] = -1
        chosen.append(int(gains.argmax()))
        active = np.isin(owner, chosen)
        solutions[:, :, active] = _solve_sums(systems, ~signed, active)
    return tuple(candidates[i] for i in chosen)


def _systems(
    model: Factors, closures: tuple[Closure, ...], grid: ViewGrid, *, again: bool = False
) -> list[_NormalEquations]:
    """The systems of all views. Soon `again` with such a model: then what they share is kept."""
    views = _kept(_dictionary, closures, grid)
    if again:
        values = map(model.lobe_values_through, _view_taps(type(model), grid))
    else:
        values = (model.lobe_values(view.wi, view.wo[None]) for view, _ in views)
    diffuse = model.diffuse.mean()
    return [
        _NormalEquations(lobes, diffuse, closures, *view)
        for lobes, view in zip(values, views, strict=True)
    ]


@lru_cache(maxsize=2)
def _view_taps(model: type[Factors], grid: ViewGrid) -> list[PairTaps]:
    """Where the points of the views lie in models of a kind."""
    return [model.pair_taps(view.wi, view.wo[None]) for row in grid.rows() for view in row]


class _NormalEquations:
    """Weighted least squares at one view, with columns scaled to unit norm."""

    def __init__(
        self,
        lobes: np.ndarray,
        diffuse: float,
        closures: tuple[Closure, ...],
        view: ViewQuadrature,
        columns: np.ndarray,
    ) -> None:
        """Lobes : (lobes, n, 3) values f of the model; diffuse : its mean, 1/sr."""
        lobes = lobes * view.wi[:, 2:]
        grey = lobes.sum(0).mean(-1) + diffuse * view.wi[:, 2]
        mean = (grey * view.solid_angle).sum() / view.solid_angle.sum()
        weight = view.solid_angle / np.maximum(grey + WEIGHT_FLOOR * mean, 1e-30)
        weight /= max((weight * grey**2).sum(), 1e-30)
        # a product with its own transpose takes half the time of any other
        halved = columns * np.sqrt(weight)
        gram = halved @ halved.T
        norm = np.sqrt(gram.diagonal())
        largest = np.maximum.reduceat(norm, _first_columns(closures))
        norm = np.maximum(norm, LEAST_NORM * largest[_owner(closures)])
        dead = _dead_columns(closures, view.wo[2] > np.cos(np.radians(1))) | (norm < 1e-7)
        self.scale = np.where(dead, 0, 1 / np.maximum(norm, 1e-7))
        gram *= self.scale  # in place: with many candidates it is large
        gram *= self.scale[:, None]
        self.matrix = gram
        self.matrix[np.diag_indices_from(self.matrix)] += RIDGE**2
        flat = lobes.swapaxes(0, 1).reshape(len(weight), -1)
        right = columns @ (flat * weight[:, None]) * self.scale[:, None]
        self.right = right.T.reshape(len(lobes), 3, -1)  # (lobes, 3, columns)
        self.weight, self.lobes = weight, lobes
        self.view, self.columns = view, columns


def _solve_sums(
    systems: list[_NormalEquations], nonnegative: np.ndarray, active: np.ndarray
) -> np.ndarray:
    """Scaled solutions (views, 3, active columns) for the sum of the lobes."""
    matrix = np.stack([system.matrix[np.ix_(active, active)] for system in systems])
    right = np.stack([system.right.sum(0)[:, active] for system in systems])
    return PartlyNonnegative(matrix, nonnegative[active]).solve(right)


def _solve_lobes(systems: list[_NormalEquations], nonnegative: np.ndarray) -> np.ndarray:
    """Weights (views, lobes, 3, columns); see the module's docstring.

    Minimises, lobe after lobe, OWN_SHARE |B x_l - y_l|^2 + |B sum x - sum y|^2.
    """
    matrix = np.stack([system.matrix for system in systems])
    right = np.stack([system.right for system in systems])
    problems = PartlyNonnegative(matrix, nonnegative)
    views, lobes, _, columns = right.shape
    x = problems.solve(right.reshape(views, -1, columns)).reshape(right.shape)
    total = right.sum(1)
    for _ in range(SWEEPS):
        for lobe in range(lobes):
            others = x.sum(1) - x[:, lobe]
            aim = OWN_SHARE * right[:, lobe] + total - others @ matrix
            x[:, lobe] = problems.solve(aim / (1 + OWN_SHARE), start=x[:, lobe])
    return x * np.stack([system.scale for system in systems])[:, None, None]


def _gains(
    system: _NormalEquations,
    solution: np.ndarray,
    free: np.ndarray,
    candidates: tuple[Closure, ...],
) -> np.ndarray:
    """How much each candidate would lower the squared residual (closures,)."""
    cross = system.matrix[free]
    inner = np.linalg.solve(cross[:, free], cross)
    residual = (system.right.sum(0) - solution @ system.matrix).T
    gains = np.empty(len(candidates))
    for width, members, columns in _by_width(candidates):
        block = system.matrix[columns[:, :, None], columns[:, None, :]] + 1e-9 * np.eye(width)
        # what the chosen ones cannot do: the Schur complement
        block -= cross[:, columns].transpose(1, 2, 0) @ inner[:, columns].transpose(1, 0, 2)
        right = residual[columns]
        step = np.linalg.solve(block, right)
        gain = (step * right).sum(1)
        if width == 2:  # microfacet: a negative step is refused, the better single column is left
            diagonal = np.einsum("nii->ni", block)[:, :, None]
            single = (np.maximum(right, 0) ** 2 / diagonal).max(1)
            gain = np.where((step >= 0).all(1), gain, single)
        gains[members] = gain.sum(1)
    return gains


@lru_cache(maxsize=2)
def _by_width(candidates: tuple[Closure, ...]) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Closures grouped by their number of columns: (width, ids, column ids)."""
    widths = np.array([c.n_columns for c in candidates])
    first = _first_columns(candidates)
    groups = []
    for width in sorted(set(widths)):
        members = np.flatnonzero(widths == width)
        groups.append((int(width), members, first[members][:, None] + np.arange(width)))
    return groups


def _picking(
    systems: list[_NormalEquations],
    closures: tuple[Closure, ...],
    weights: np.ndarray,
    grid: ViewGrid,
) -> np.ndarray:
    """Picking weights (views, lobes, closures): ramps cover what microfacet closures leave.

    Cycles picks a direction from the mixture of its closures' densities. For a ramp the density is
    free of its colours, so its share is fitted: mixture of densities = mean value of the channels.
    """
    ramps = [i for i, closure in enumerate(closures) if closure.signed]
    picking = np.zeros((*weights.shape[:2], len(closures)))
    if not ramps:
        return picking
    microfacet = ~_signed_columns(closures)
    matrices, rights, norms = [], [], []
    views = _kept(_ramp_densities, closures, grid)
    for system, x, densities in zip(systems, weights, views, strict=True):
        norm = 1 / np.sqrt((densities**2 * system.weight).sum(1) + 1e-30)
        scaled = densities * norm[:, None]
        weighted = scaled * system.weight
        matrices.append(weighted @ scaled.T + RIDGE**2 * np.eye(len(ramps)))
        covered = x[:, :, microfacet].mean(1) @ system.columns[microfacet]
        rights.append((system.lobes.mean(-1) - covered) @ weighted.T)
        norms.append(norm)
    problems = PartlyNonnegative(np.array(matrices), np.ones(len(ramps), bool))
    picking[:, :, ramps] = problems.solve(np.array(rights)) * np.array(norms)[:, None]
    return picking


def _signed_columns(closures: Sequence[Closure]) -> np.ndarray:
    """For every column, whether its weight may be negative."""
    return np.repeat([c.signed for c in closures], [c.n_columns for c in closures])


def _owner(closures: Sequence[Closure]) -> np.ndarray:
    """Which closure every column belongs to."""
    return np.repeat(np.arange(len(closures)), [c.n_columns for c in closures])


def _first_columns(closures: Sequence[Closure]) -> np.ndarray:
    """Where the columns of every closure begin."""
    return np.cumsum([0, *(c.n_columns for c in closures[:-1])])


@lru_cache(maxsize=4)
def _dead_columns(closures: tuple[Closure, ...], facing: bool) -> np.ndarray:
    """Columns not to be used at a view, which may be that along the normal.

    At normal incidence there is no direction to lean away to. A diffuse ramp is sampled in
    proportion to the cosine: a colour at the horizon, where f cos is 0 anyway, would have a
    variance without bound.
    """
    dead = []
    for closure in closures:
        columns = np.full(closure.n_columns, facing and closure.lean < 0)
        columns[0] |= closure.kind == "diffuse_ramp"
        dead.append(columns)
    return np.concatenate(dead)


def _kept(function: Callable, closures: tuple[Closure, ...], grid: ViewGrid) -> list:
    """What a function has for the views. It depends on no material: edits use it again."""
    n_columns = sum(closure.n_columns for closure in closures)
    is_small = grid.n_points * n_columns <= MOST_KEPT
    return (function if is_small else function.__wrapped__)(closures, grid)


@lru_cache(maxsize=4)
def _dictionary(
    closures: tuple[Closure, ...], grid: ViewGrid
) -> list[tuple[ViewQuadrature, np.ndarray]]:
    """Quadratures and columns at the views."""
    pairs = []
    for row in grid.rows():
        turning = {c: c.columns(row[0].wi, row[0].wo) for c in closures if c.turns_with_the_view}
        for view in row:
            columns = [
                turning[c] if c in turning else c.columns(view.wi, view.wo) for c in closures
            ]
            pairs.append((view, np.concatenate(columns)))
    return pairs


@lru_cache(maxsize=4)
def _ramp_densities(closures: tuple[Closure, ...], grid: ViewGrid) -> list[np.ndarray]:
    """Densities (ramps, n) of the ramp closures at each view."""
    ramps = [closure for closure in closures if closure.signed]
    return [
        np.stack([ramp.density(view.wi, view.wo) for ramp in ramps])
        for row in grid.rows()
        for view in row
    ]
