# SPDX-License-Identifier: GPL-3.0-or-later
"""Small plots of a model as pixels: its factors, and slices against the measurement."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..fitter.geometry import theta_d_centres, theta_h_centres
from ..fitter.grading.slices import INCIDENCE, THETA_O, model_slices
from ..fitter.models.model import FactorModel
from ..fitter.models.splines import masking_nodes

SIZE = 384
MARGIN = 6
DECADES = 4  # of logarithmic axes
WIDTH = 3.0  # of lines, pixels
FAINT = 0.75  # brightness of the model as fitted, behind the edited one

BACKGROUND = (0.07, 0.07, 0.07)
GRID = (0.22, 0.22, 0.22)
MEASURED = (0.62, 0.62, 0.62)
LOBES = ((1.0, 0.72, 0.25), (0.35, 0.75, 1.0), (0.75, 0.5, 1.0))
CHANNELS = ((1.0, 0.35, 0.3), (0.35, 0.9, 0.4), (0.4, 0.6, 1.0))
SLICES = ((1.0, 0.85, 0.35), (1.0, 0.6, 0.3), (0.95, 0.4, 0.45), (0.75, 0.4, 0.85))


class Plot:
    """A square picture; curves have x and y from 0 to 1."""

    def __init__(self, columns: int = 3, rows: int = 4) -> None:
        self._pixels = np.empty((SIZE, SIZE, 3), np.float32)
        self._pixels[:] = BACKGROUND
        self._at = np.arange(SIZE)
        inside = slice(MARGIN, SIZE - MARGIN)
        for line in range(columns + 1):
            self._pixels[inside, self._position(line / columns), :] = GRID
        for line in range(rows + 1):
            self._pixels[self._position(line / rows), inside, :] = GRID

    @staticmethod
    def _position(share: float) -> int:
        return round(MARGIN + share * (SIZE - 1 - 2 * MARGIN))

    def curve(
        self, x: np.ndarray, y: np.ndarray, color: tuple[float, ...], width: float = WIDTH
    ) -> None:
        """A line through points with rising x; none where y is NaN, cut off at the frame."""
        span = SIZE - 1 - 2 * MARGIN
        share = (self._at - MARGIN) / span
        height = MARGIN + np.clip(np.interp(share, x, y), 0, 1) * span
        # the distance to a steep line is less than that along the column
        slope = np.gradient(height)
        distance = np.abs(self._at[:, None] - height) / np.sqrt(1 + slope**2)
        cover = np.clip(width / 2 + 0.5 - distance, 0, 1)
        cover = np.where((share >= 0) & (share <= 1) & ~np.isnan(height), cover, 0)[..., None]
        self._pixels += cover * (np.array(color) - self._pixels)

    def curves(
        self,
        x: np.ndarray,
        heights: Sequence[np.ndarray | None],
        colors: Sequence[tuple[float, ...]],
    ) -> None:
        """Curves as edited over thin ones as fitted: two arrays (curves, n), or None."""
        edited, fitted = heights
        if fitted is not None:
            for row, color in zip(fitted, colors, strict=True):
                self.curve(x, row, tuple(FAINT * c for c in color), WIDTH / 3)
        for row, color in zip(edited, colors, strict=True):
            self.curve(x, row, color)

    def pixels(self) -> np.ndarray:
        """RGBA (SIZE, SIZE, 4) float32, bottom row first."""
        rgba = np.ones((SIZE, SIZE, 4), np.float32)
        rgba[..., :3] = self._pixels
        return rgba


def plot_ndf(model: FactorModel, fitted: FactorModel | None, _measured: object) -> np.ndarray:
    """D of the lobes over the square root of theta_h, in decades."""
    x = np.sqrt(theta_h_centres() / (np.pi / 2))
    models = (model, fitted)
    return _factors(x, [_decades(m.ndf, 1.0) if m else None for m in models], LOBES, rows=DECADES)


def plot_masking(model: FactorModel, fitted: FactorModel | None, _measured: object) -> np.ndarray:
    """G of the lobes over theta."""
    x = masking_nodes() / (np.pi / 2)
    return _factors(x, [m.masking if m else None for m in (model, fitted)], LOBES)


def plot_fresnel(model: FactorModel, fitted: FactorModel | None, _measured: object) -> np.ndarray:
    """F of the channels over theta_d."""
    x = theta_d_centres() / (np.pi / 2)
    return _factors(x, [m.fresnel if m else None for m in (model, fitted)], CHANNELS)


def plot_slices(
    model: FactorModel, fitted: FactorModel | None, measured: np.ndarray | None
) -> np.ndarray:
    """Values f cos theta_o in the plane of incidence, in decades; the data in grey."""
    plot = Plot(columns=6, rows=DECADES)
    x = (THETA_O / np.pi) + 0.5
    cosine = np.cos(THETA_O)
    values = [m and model_slices(m).mean(-1) * cosine for m in (model, fitted)]
    # the scale stays that of the fit, so that edits can be compared with it
    scale = values[0] if fitted is None else values[1]
    peak = max(float(scale[INCIDENCE < 1.2].max()), 1e-9) * 1.5
    if measured is not None:
        for row in measured.mean(-1) * cosine:
            plot.curve(x, _decades(row, peak), MEASURED, width=2.5 * WIDTH)
    plot.curves(x, [v if v is None else _decades(v, peak) for v in values], SLICES)
    return plot.pixels()


Plotter = Callable[[FactorModel, FactorModel | None, np.ndarray | None], np.ndarray]

# Each takes the model as edited, as fitted (None: there are no edits), and measured slices.
PLOTS: dict[str, Plotter] = {
    "NDF": plot_ndf,
    "FRESNEL": plot_fresnel,
    "MASKING": plot_masking,
    "SLICES": plot_slices,
}


def _factors(
    x: np.ndarray,
    heights: Sequence[np.ndarray | None],
    colors: Sequence[tuple[float, ...]],
    rows: int = 4,
) -> np.ndarray:
    plot = Plot(rows=rows)
    plot.curves(x, heights, colors)
    return plot.pixels()


def _decades(values: np.ndarray, peak: float) -> np.ndarray:
    """0..1 over DECADES up to the peak."""
    return 1 + np.log10(np.maximum(values / peak, 1e-12)) / DECADES
