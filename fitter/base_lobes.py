# SPDX-License-Identifier: GPL-3.0-or-later
"""The base: each lobe of a model as a mixture of closures that Cycles can evaluate.

A shader never sees the light direction, so a renderer can sample lights for a material only through
closures of its own. For every lobe and view angle the lobe is written as a sum of a few of them
(closures.py), whose weights stand in a table over the view angle and are interpolated linearly.

One set of closures serves all lobes and view angles, since that is what costs time per sample. It
is picked for the material from a catalogue by `select_closures`; the weights are least squares
with the compressive weight 1 / (f cos + small), non-negative for microfacet closures and free for
ramps. Every lobe is fitted for itself and, with the larger weight, as its part of the sum: the
sum is what an untouched material shows, the single lobes are what an artist scales.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .closures import Closure
from .model import FactorModel
from .nnls import PartlyNonnegative
from .quadrature import ViewQuadrature, view_quadrature

N_CLOSURES = 10

# View angles of the table, degrees. Lobes change fastest towards grazing; the first ones are close
# because closures that lean away from the viewer must fade out where there is no direction to lean.
VIEW_ANGLES = np.radians(
    [
        0.5,
        2,
        5,
        10,
        15,
        20,
        25,
        30,
        35,
        40,
        45,
        50,
        55,
        60,
        63,
        66,
        69,
        72,
        75,
        78,
        81,
        84,
        86,
        88,
        89.5,
    ]
)

# Selection looks at fewer view angles and fewer directions; it only ranks closures.
SELECTION_ANGLES = np.radians([0.5, 16, 32, 48, 60, 72, 80, 85])
SELECTION_POINTS = (64, 12)
FIT_POINTS = (96, 16)

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

# Microfacet roughnesses of the catalogue: ratio sqrt(2), from a mirror to matte.
_ALPHAS = (
    *(0.002, 0.003, 0.0045, 0.0065, 0.0095, 0.0135, 0.019, 0.027, 0.038),
    *(0.054, 0.076, 0.11, 0.155, 0.22, 0.31, 0.44, 0.62, 0.9),
)

CATALOGUE = (
    *(Closure("ggx", alpha) for alpha in _ALPHAS),
    *(Closure("beckmann", alpha) for alpha in _ALPHAS),
    Closure("diffuse_ramp"),
    *(Closure("phong_ramp", n) for n in (1, 4, 12, 40, 120, 400, 2000, 10000, 50000)),
    *(Closure("phong_ramp", n, lean) for lean in (0.5, 1.0) for n in (0, 2, 8, 40)),
    *(Closure("phong_ramp", n, lean) for lean in (-0.3, -0.6) for n in (2, 12, 60, 300)),
)


@dataclass(frozen=True)
class BaseLobes:
    """Weights of closures over the view angle, with the model's own scales in them.

    closures : the dictionary, in the order of the columns
    theta_o : (nodes,) radians
    weights : (nodes, lobes, 3, columns); microfacet columns are >= 0
    picking : (nodes, lobes, closures) how much Cycles shall pick each ramp closure, as a share
        of light like an albedo; 0 for microfacet closures, which are picked by their weight
    """

    closures: tuple[Closure, ...]
    theta_o: np.ndarray
    weights: np.ndarray
    picking: np.ndarray

    def value(self, wi: np.ndarray, wo: np.ndarray, tints: np.ndarray | None = None) -> np.ndarray:
        """Value f cos(theta_i) of the specular sum (n, 3), 1/sr, for wi (n, 3) and one wo (3,).

        tints : (lobes, 3) factors of the lobes; None is 1
        """
        weights = self.weights_at(float(np.arctan2(np.hypot(wo[0], wo[1]), wo[2])))
        if tints is not None:
            weights = weights * tints[:, :, None]
        columns = np.concatenate([closure.columns(wi, wo) for closure in self.closures])
        return (weights.sum(0) @ columns).T

    def weights_at(self, theta_o: float) -> np.ndarray:
        """Weights (lobes, 3, columns) at a view angle, linear between the nodes."""
        left, t = self._interval(theta_o)
        return self.weights[left] * (1 - t) + self.weights[left + 1] * t

    def _interval(self, theta_o: float) -> tuple[int, float]:
        nodes = self.theta_o
        left = int(np.clip(np.searchsorted(nodes, theta_o) - 1, 0, len(nodes) - 2))
        t = (theta_o - nodes[left]) / (nodes[left + 1] - nodes[left])
        return left, float(np.clip(t, 0, 1))


def fit_base_lobes(model: FactorModel, closures: Sequence[Closure] | None = None) -> BaseLobes:
    """Base of a model.

    closures : dictionary to use, for instance that of the model before an edit, which saves the
        selection; None selects N_CLOSURES of the catalogue
    """
    closures = tuple(closures or select_closures(model, N_CLOSURES))
    signed = _signed_columns(closures)
    systems = [
        _NormalEquations(model, closures, view, columns)
        for view, columns in zip(
            *_dictionary(closures, tuple(VIEW_ANGLES), *FIT_POINTS), strict=True
        )
    ]
    weights = _solve_lobes(systems, ~signed)
    return BaseLobes(closures, VIEW_ANGLES, weights, _picking(systems, closures, weights))


def select_closures(model: FactorModel, count: int) -> tuple[Closure, ...]:
    """The `count` closures of the catalogue that together follow the sum of the lobes best.

    Forward selection: at each step the closure that would lower the squared residual most, with
    those already chosen free to adapt, summed over view angles and channels.
    """
    signed = _signed_columns(CATALOGUE)
    owner = np.repeat(np.arange(len(CATALOGUE)), [c.n_columns for c in CATALOGUE])
    views, dictionary = _dictionary(CATALOGUE, tuple(SELECTION_ANGLES), *SELECTION_POINTS)
    systems = [
        _NormalEquations(model, CATALOGUE, view, columns)
        for view, columns in zip(views, dictionary, strict=True)
    ]
    # share of a sphere's projected area that is seen at each view angle
    areas = np.sin(SELECTION_ANGLES) * np.cos(SELECTION_ANGLES) * np.gradient(SELECTION_ANGLES)
    areas += 0.005
    chosen: list[int] = []
    solutions = np.zeros((len(systems), 3, len(owner)))
    while len(chosen) < count:
        gains = np.zeros(len(CATALOGUE))
        for system, solution, area in zip(systems, solutions, areas, strict=True):
            free = np.isin(owner, chosen) & (signed | (solution != 0).any(0))
            gains += area * _gains(system, solution, free)
        gains[chosen] = -1
        chosen.append(int(gains.argmax()))
        active = np.isin(owner, chosen)
        solutions[:, :, active] = _solve_sums(systems, ~signed, active)
    return tuple(CATALOGUE[i] for i in chosen)


class _NormalEquations:
    """Weighted least squares at one view angle, with columns scaled to unit norm."""

    def __init__(
        self,
        model: FactorModel,
        closures: tuple[Closure, ...],
        view: ViewQuadrature,
        columns: np.ndarray,
    ) -> None:
        wo = np.broadcast_to(view.wo, view.wi.shape)
        self.lobes = model.lobe_values(view.wi, wo) * view.wi[:, 2][None, :, None]
        grey = self.lobes.sum(0).mean(-1) + model.diffuse.mean() * view.wi[:, 2]
        mean = (grey * view.solid_angle).sum() / view.solid_angle.sum()
        weight = view.solid_angle / np.maximum(grey + WEIGHT_FLOOR * mean, 1e-30)
        self.weight = weight / max((weight * grey**2).sum(), 1e-30)
        self.view, self.columns = view, columns
        norm = np.sqrt((columns**2 * self.weight).sum(1))
        widths = [closure.n_columns for closure in closures]
        largest = np.maximum.reduceat(norm, np.cumsum([0, *widths[:-1]]))
        norm = np.maximum(norm, LEAST_NORM * np.repeat(largest, widths))
        dead = _dead_columns(closures, view) | (norm < 1e-7)
        self.scale = np.where(dead, 0, 1 / np.maximum(norm, 1e-7))
        scaled = columns * self.scale[:, None]
        weighted = scaled * self.weight
        self.matrix = weighted @ scaled.T
        self.matrix[np.diag_indices_from(self.matrix)] += RIDGE**2
        self.right = (weighted @ self.lobes).swapaxes(1, 2)  # (lobes, 3, columns)


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


def _gains(system: _NormalEquations, solution: np.ndarray, free: np.ndarray) -> np.ndarray:
    """How much each closure of the catalogue would lower the squared residual (closures,)."""
    schur = system.matrix.copy()
    if free.any():
        inner = np.linalg.solve(schur[np.ix_(free, free)], schur[free])
        schur -= schur[:, free] @ inner
    residual = (system.right.sum(0) - solution @ system.matrix).T
    gains = np.empty(len(CATALOGUE))
    for width, members, columns in _by_width():
        block = schur[columns[:, :, None], columns[:, None, :]] + 1e-9 * np.eye(width)
        right = residual[columns]
        step = np.linalg.solve(block, right)
        gain = (step * right).sum(1)
        if width == 2:  # microfacet: a negative step is refused, the better single column is left
            diagonal = np.einsum("nii->ni", block)[:, :, None]
            single = (np.maximum(right, 0) ** 2 / diagonal).max(1)
            gain = np.where((step >= 0).all(1), gain, single)
        gains[members] = gain.sum(1)
    return gains


@lru_cache(maxsize=1)
def _by_width() -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Closures of the catalogue grouped by their number of columns: (width, ids, column ids)."""
    widths = np.array([c.n_columns for c in CATALOGUE])
    first = np.concatenate([[0], np.cumsum(widths)[:-1]])
    groups = []
    for width in sorted(set(widths)):
        members = np.flatnonzero(widths == width)
        groups.append((int(width), members, first[members][:, None] + np.arange(width)))
    return groups


def _picking(
    systems: list[_NormalEquations], closures: tuple[Closure, ...], weights: np.ndarray
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
    for system, x, densities in zip(systems, weights, _ramp_densities(closures), strict=True):
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


@lru_cache(maxsize=4)
def _ramp_densities(closures: tuple[Closure, ...]) -> list[np.ndarray]:
    """Densities (ramps, n) of the ramp closures at each view angle of the table."""
    views, _ = _dictionary(closures, tuple(VIEW_ANGLES), *FIT_POINTS)
    return [np.stack([c.density(v.wi, v.wo) for c in closures if c.signed]) for v in views]


def _signed_columns(closures: Sequence[Closure]) -> np.ndarray:
    """For every column, whether its weight may be negative."""
    return np.repeat([c.signed for c in closures], [c.n_columns for c in closures])


def _dead_columns(closures: Sequence[Closure], view: ViewQuadrature) -> np.ndarray:
    """Columns not to be used.

    At normal incidence there is no direction to lean away to. A diffuse ramp is sampled in
    proportion to the cosine: a colour at the horizon, where f cos is 0 anyway, would have a
    variance without bound.
    """
    facing = view.wo[2] > np.cos(np.radians(1))
    dead = []
    for closure in closures:
        columns = np.full(closure.n_columns, facing and closure.lean < 0)
        columns[0] |= closure.kind == "diffuse_ramp"
        dead.append(columns)
    return np.concatenate(dead)


@lru_cache(maxsize=4)
def _dictionary(
    closures: tuple[Closure, ...], angles: tuple[float, ...], n_theta: int, n_phi: int
) -> tuple[list[ViewQuadrature], list[np.ndarray]]:
    """Quadratures and columns at view angles; they depend on no material, so edits reuse them."""
    views = [view_quadrature(angle, n_theta, n_phi) for angle in angles]
    columns = [np.concatenate([c.columns(view.wi, view.wo) for c in closures]) for view in views]
    return views, columns
