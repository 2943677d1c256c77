# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a model is from what a viewer sees of the data: albedos, and pixels under lights.

Eq. 2 compares values one by one. A picture shows integrals of f cos theta_i over the light:
errors that have the same sign over many directions hardly count in squares of values but add up
there, errors that alternate cancel. So the last joint steps (`joint`) minimise beside E

- the relative errors of the directional albedo, which is what a uniform light shows;
- the squared errors of display values on a sphere under synthetic environments.

Both are integrals over the same directions at each of some view angles. They are linear in d, s, D
and F and quadratic in G. A view sees some thousand bins, so a step costs a fraction of that of E.

The light that falls on bins without a measurement is left out of data and model alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import N_THETA_D, merl_bin_index, merl_bins
from ..measurement import Measurement
from ..models import splines
from ..models.model import FactorModel
from ..pictures.environments import synthetic_maps
from ..pictures.sphere import DISPLAY_GAMMA, EXPOSURE, texel_index
from .albedo import VIEW_ANGLES, half_vectors, mirrored_bins

# Azimuths of half vectors over half a turn; the model is even in the other half. Data and model
# are summed over the same, so few are enough.
N_PHI = 24

# Relative errors of the albedo count as e^2 below this and as e^4 above: the largest matters.
TOLERANCE = 0.02

# What the mean of that, and the mean squared error of pictures relative to that of a black one,
# are worth in units of E.
ALBEDO_WORTH = 6.0
PICTURE_WORTH = 100.0

# Turns of each map, at random, under which every view angle is looked at.
TURNS = 3

# Display values are not told apart below this linear value.
BLACK = 1e-6


@dataclass(frozen=True)
class _View:
    """Directions at one view angle (k) and lights, the first of them uniform (lights, k).

    bin_h, bin_d : (k,) bins of each direction, ordered by bin_h
    rings, ring_start : the bins of theta_h that occur, and where each begins
    at_d : (k, 90) 1 at bin_d, float32
    taps_i, taps_o : (k, 90) what takes control points to G at theta_i and theta_o, float32
    lobe_weight : (k,) cos theta_i, solid angle and 1 / (cos_i cos_o), what lobes are summed with
    light : (lights, k) float32
    diffuse_weight : (lights,) what Lambert's 1 reflects of them
    """

    bin_h: np.ndarray
    bin_d: np.ndarray
    rings: np.ndarray
    ring_start: np.ndarray
    at_d: np.ndarray
    taps_i: np.ndarray
    taps_o: np.ndarray
    lobe_weight: np.ndarray
    light: np.ndarray
    diffuse_weight: np.ndarray


@dataclass(frozen=True)
class AppearanceError:
    """How far models are from what one measurement looks like.

    views : that see light of the measurement in every channel
    albedo : (views, 3) of the data
    exposure : (pixels,) what takes a light's linear values to the display's, 1 being white
    pixels : (views, pixels, 3) display values of the data
    share : (views, 1, 1) root of what a squared error of these is worth
    """

    views: tuple[_View, ...]
    albedo: np.ndarray
    exposure: np.ndarray
    pixels: np.ndarray
    share: np.ndarray

    @classmethod
    def of(
        cls,
        measurement: Measurement,
        n_maps: int = 8,
        *,
        diffuse_shape: np.ndarray | None = None,
    ) -> AppearanceError:
        """Of a measurement.

        n_maps : environments; 0 for the albedo alone
        diffuse_shape : (90, 90, 180) what the diffuse part is multiplied with, for experiments;
            default Lambert's 1
        """
        maps = synthetic_maps(n_maps)
        rng = np.random.default_rng(0)
        views, seen, area = [], [], []
        for theta_o in np.radians(VIEW_ANGLES):
            view, values = _view(measurement, theta_o, maps, rng, diffuse_shape)
            if not (values[0] > 0).all():
                continue
            views.append(view)
            seen.append(values)
            # what an orthographic picture of a sphere shows of each angle; at 0 a disc of 2.5
            area.append(max(np.sin(2 * theta_o), np.sin(np.radians(2.5))))
        count = n_maps * TURNS
        seen = np.array(seen).reshape(len(views), 1 + count, 3)
        area = np.array(area) / np.sum(area)
        mean = np.einsum("v,vpc->p", area, seen[:, 1:]).reshape(n_maps, TURNS).mean(1) / 3
        exposure = np.repeat(EXPOSURE / np.where(mean > 0, mean, 1), TURNS)
        pixels, _ = _displayed(seen[:, 1:] * exposure[:, None])
        energy = np.einsum("v,vpc->", area, pixels**2)
        share = np.sqrt(PICTURE_WORTH * area / energy) if energy > 0 else area
        return cls(tuple(views), seen[:, 0], exposure, pixels, share[:, None, None])

    def value(self, model: FactorModel) -> float:
        """ALBEDO_WORTH times the mean of e^2 (1 + (e / TOLERANCE)^2) for relative errors e.

        And PICTURE_WORTH times the mean squared error of pixels over their mean square.
        """
        return float((self._residual(self.seen(model))[0] ** 2).sum())

    def seen(self, model: FactorModel) -> np.ndarray:
        """Linear values (views, 1 + pixels, 3): the albedo, and what the lights show."""
        out = [
            view.light @ _lobes(model, view)[0].sum(0).T
            + view.diffuse_weight[:, None] * model.diffuse
            for view in self.views
        ]
        return np.array(out).reshape(len(self.views), 1 + len(self.exposure), 3)

    def residual_and_jacobian(self, model: FactorModel) -> tuple[np.ndarray, np.ndarray]:
        """Residuals r (n,) with `value` = r . r, and their derivatives (n, 822), float32.

        To the logarithms of D, F, G and s and to d, in the order of `joint`.
        """
        shape = (len(self.views), 1 + len(self.exposure), 3)
        factors = (model.ndf, model.fresnel, model.masking, model.scale, model.diffuse)
        ends = np.cumsum([factor.size for factor in factors])
        # single precision is enough for slopes, and twice as quick
        jacobian = np.zeros((*shape, ends[-1]), np.float32)
        seen = np.empty(shape)
        for number, view in enumerate(self.views):
            parts = np.split(jacobian[number], ends[:-1], axis=-1)
            of_factors = [
                part.reshape(*shape[1:], *factor.shape)
                for part, factor in zip(parts, factors, strict=True)
            ]
            assert all(np.shares_memory(jacobian, part) for part in of_factors)
            seen[number] = _differentiate(model, view, of_factors)
        residual, slope = self._residual(seen)
        jacobian *= slope.reshape(*shape, 1)
        return residual, jacobian.reshape(seen.size, ends[-1])

    def _residual(self, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (n,) of linear values and their derivatives to those."""
        error = seen[:, 0] / self.albedo - 1
        square = (error / TOLERANCE) ** 2
        root = np.sqrt(1 + square)
        share = np.sqrt(ALBEDO_WORTH / max(error.size, 1))
        values, slopes = _displayed(seen[:, 1:] * self.exposure[:, None])
        of_albedo = share * error * root
        of_pixels = self.share * (values - self.pixels)
        albedo_slope = share * (1 + 2 * square) / root / self.albedo
        pixel_slope = self.share * slopes * self.exposure[:, None]
        return (
            np.concatenate([of_albedo[:, None], of_pixels], axis=1).ravel(),
            np.concatenate([albedo_slope[:, None], pixel_slope], axis=1).ravel(),
        )


def _view(
    measurement: Measurement,
    theta_o: float,
    maps: np.ndarray,
    rng: np.random.Generator,
    diffuse_shape: np.ndarray | None,
) -> tuple[_View, np.ndarray]:
    """A view and what it shows of the data (lights, 3)."""
    view = half_vectors(N_PHI).at_view(theta_o)
    bins = merl_bin_index(view.wi, np.broadcast_to(view.wo, view.wi.shape))
    mirrored = mirrored_bins(bins)
    # the other half of the directions, with y negated, has the mirrored bins
    measured = (measurement.valid[bins] + 1.0 * measurement.valid[mirrored]) / 2
    some = measured > 0
    bins, mirrored = (tuple(axis[some] for axis in index) for index in (bins, mirrored))
    wi = view.wi[some]
    projected = wi[:, 2] * view.solid_angle[some]
    light = _lights(wi, maps, rng).astype(np.float32)
    f_r = (measurement.f_r[bins] + measurement.f_r[mirrored]) / 2  # 0 where there is none
    weight = projected * measured[some]
    grid = merl_bins()
    cos_i, cos_o = grid.cos_i[bins], grid.cos_o[bins]
    rings, ring_start = np.unique(bins[0], return_index=True)
    at_d = np.zeros((len(weight), N_THETA_D), np.float32)
    at_d[np.arange(len(weight)), bins[1]] = 1
    shape = 1 if diffuse_shape is None else diffuse_shape[bins]
    found = _View(
        bin_h=bins[0],
        bin_d=bins[1],
        rings=rings,
        ring_start=ring_start,
        at_d=at_d,
        taps_i=splines.catmull_rom_taps(np.arccos(cos_i)).matrix().astype(np.float32),
        taps_o=splines.catmull_rom_taps(np.arccos(cos_o)).matrix().astype(np.float32),
        lobe_weight=weight / (cos_i * cos_o),
        light=light,
        diffuse_weight=light @ (weight * shape),
    )
    return found, light @ (projected[:, None] * f_r)


def _lights(wi: np.ndarray, maps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Radiance (lights, k) from directions wi (k, 3), the mean with that from their mirror images.

    The first light is uniform; the others are the maps, turned.
    """
    rows = [np.ones(len(wi))]
    for image in maps:
        texels = image.ravel()
        for _ in range(TURNS):
            turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            sides = (texels[texel_index((wi * [1, side, 1]) @ turned)] for side in (1, -1))
            rows.append(sum(sides) / 2)
    return np.array(rows)


def _lobes(model: FactorModel, view: _View) -> tuple[np.ndarray, ...]:
    """Lobe values (lobes, 3, k) to be summed with light, the same without G, G_i and G_o."""
    # as in the problem, without the bound at 0 between control points
    masking_i, masking_o = model.masking @ view.taps_i.T, model.masking @ view.taps_o.T
    lobes = model.scale[:, :, None] * model.ndf[:, view.bin_h][:, None]
    amplitudes = lobes * model.fresnel[:, view.bin_d] * view.lobe_weight
    return amplitudes * (masking_i * masking_o)[:, None], amplitudes, masking_i, masking_o


def _differentiate(model: FactorModel, view: _View, derivatives: list[np.ndarray]) -> np.ndarray:
    """Fill the derivatives of one view's values to D, F, G, s and d; returns the values.

    derivatives : of the values (lights, 3) to each factor, zero at first
    """
    ndf, fresnel, masking, scale, diffuse = derivatives
    lobes, amplitudes, masking_i, masking_o = _lobes(model, view)
    short, bare = lobes.astype(np.float32), amplitudes.astype(np.float32)
    seen = view.light @ lobes.sum(0).T + view.diffuse_weight[:, None] * model.diffuse
    for m in range(model.n_lobes):
        to_masking = masking_o[m].astype(np.float32)[:, None] * view.taps_i
        to_masking += masking_i[m].astype(np.float32)[:, None] * view.taps_o
        for c in range(3):
            lit = view.light * short[m, c]
            ndf[:, c, m, view.rings] = np.add.reduceat(lit, view.ring_start, axis=1)
            scale[:, c, m, c] = lit.sum(1)
            masking[:, c, m] = ((view.light * bare[m, c]) @ to_masking) * model.masking[m]
    for c in range(3):
        fresnel[:, c, c] = (view.light * short[:, c].sum(0)) @ view.at_d
        diffuse[:, c, c] = view.diffuse_weight
    return seen


def _displayed(linear: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Display values, clipped as a display does, and their derivatives."""
    clipped = np.clip(linear, BLACK, 1)
    values = clipped ** (1 / DISPLAY_GAMMA)
    inside = (linear > BLACK) & (linear < 1)
    return values, np.where(inside, values / clipped / DISPLAY_GAMMA, 0)
