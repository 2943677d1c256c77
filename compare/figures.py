# SPDX-License-Identifier: GPL-3.0-or-later
"""The charts and pictures of a report, as PNG bytes; matplotlib without a window or global state.

Everything is drawn from Results; nothing is fitted or rendered here.
"""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fitter.geometry import theta_d_centres, theta_h_centres
from fitter.grading.slices import INCIDENCE, THETA_O
from fitter.models.model import FactorModel
from fitter.models.splines import masking_nodes
from fitter.pictures.sphere import display

from .grading import Result
from .models import CONTENDERS, INDEPENDENT_G

DPI = 110

# Around the objects, as a display value.
BACKDROP = 0.13

# How much brighter differences are shown than they are.
DIFFERENCE_GAIN = 8

# From here to the horizon, degrees, slices are marked as grazing: measurements are least reliable.
GRAZING = 80
GRAZING_COLOR = "#f8e6c4"

# Slices show this many decades below the data's peak at most.
DECADES = 4.5

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

CHANNEL_COLORS = ("#d62728", "#2ca02c", "#1f77b4")
LOBE_STYLES = ("-", "--", ":")

# Inches.
SLICES_SIZE = (11, 7.2)

# D is shown down to this share of its maximum.
SMALLEST_NDF = 1e-6


def psnr_chart(results: Sequence[Result]) -> bytes:
    """Mean rendered PSNR of every model and material, in the order given (fig. 3)."""
    labelled = len(results) <= 120
    width = np.clip(0.165 * len(results), 7, 16)
    figure = Figure(figsize=(width, 5 if labelled else 4), layout="constrained")
    axes = figure.subplots()
    x = np.arange(len(results))
    for contender in CONTENDERS:
        values = [result.grades[contender.key].mean_psnr for result in results]
        axes.plot(
            x, values, "o-", color=contender.color, label=contender.label, markersize=3.5, lw=1.1
        )
    if labelled:
        axes.set_xticks(x, [_shortened(r.name) for r in results], rotation=90, fontsize=7)
    axes.set_xlim(-0.8, len(results) - 0.2)
    axes.set_ylabel("mean rendered PSNR, dB")
    axes.grid(alpha=0.25)
    figure.legend(loc="outside upper center", ncols=len(CONTENDERS), frameon=False)
    _open(axes)
    return _png(figure)


def picture_sheet(result: Result, scenes: Sequence[str]) -> bytes:
    """Data and models side by side; below each model what differs from the data."""
    # as tall as the picture is in a column of this width, within bounds
    shapes = [picture.shape[1:3] for picture in result.pictures for _ in range(2)]
    heights = [min(height / width, 1.6) for height, width in shapes]
    figure = Figure(figsize=(11, 2.15 * sum(heights) + 0.6), layout="constrained")
    grid = figure.subplots(len(heights), 1 + len(CONTENDERS), squeeze=False, height_ratios=heights)
    for scene, name in enumerate(scenes):
        pictures = _displayed(result.pictures[scene])
        for column, picture in enumerate(pictures):
            shown, difference = grid[2 * scene, column], grid[2 * scene + 1, column]
            _show(shown, picture)
            if column == 0:
                shown.set_title(f"Data, {name}", fontsize=10)
                difference.axis("off")
                text = f"|model - data|\nshown {DIFFERENCE_GAIN} times\nas bright"
                difference.text(0.5, 0.5, text, ha="center", va="center", fontsize=9)
                continue
            contender = CONTENDERS[column - 1]
            psnr = result.grades[contender.key].rendered_psnr[scene]
            shown.set_title(f"{contender.label}  {psnr:.1f} dB", fontsize=10)
            inside = ~np.isnan(picture)
            error = np.where(inside, np.abs(picture - pictures[0]) * DIFFERENCE_GAIN, np.nan)
            _show(difference, error)
    return _png(figure)


def factor_curves(name: str, factors: dict[str, FactorModel]) -> bytes:
    """D, F and G of a material (fig. 5): a row for each model that has factors."""
    figure = Figure(figsize=(11, 3.1 * len(factors)), layout="constrained")
    rows = figure.subplots(len(factors), 3, squeeze=False)
    labels = {contender.key: contender.label for contender in CONTENDERS}
    for axes, (key, model) in zip(rows, factors.items(), strict=True):
        model = model.normalized()
        theta_h, theta_d = np.degrees(theta_h_centres()), np.degrees(theta_d_centres())
        theta = np.degrees(masking_nodes())
        for lobe in range(model.n_lobes):
            if key == INDEPENDENT_G:
                style = {"color": CHANNEL_COLORS[lobe], "label": "RGB"[lobe]}
            else:
                style = {"color": "k", "ls": LOBE_STYLES[lobe % 3], "label": f"lobe {lobe + 1}"}
            axes[0].plot(theta_h, np.maximum(model.ndf[lobe], 1e-12), lw=1.4, **style)
            axes[2].plot(theta, model.masking[lobe], lw=1.4, **style)
        for channel, color in enumerate(CHANNEL_COLORS):
            theta_d, style = (
                np.degrees(theta_d_centres()),
                {"color": color, "label": "RGB"[channel]},
            )
            axes[1].plot(theta_d, model.fresnel[channel], lw=1.4, **style)
        # the square-root axis of the MERL grid, on which D has its resolution at the peak
        axes[0].set_xscale("function", functions=(_signed_sqrt, np.square))
        axes[0].set_xticks([0, 1, 5, 15, 30, 60, 90])
        axes[0].set_yscale("log")
        axes[0].set_ylim(SMALLEST_NDF, 2)
        for axis, factor, angle in zip(axes, "DFG", ("theta_h", "theta_d", "theta"), strict=True):
            axis.set_xlim(0, 90)
            axis.set_xlabel(f"{angle}, degrees", fontsize=9)
            axis.set_title(f"{labels[key]}: {factor}", fontsize=10)
            axis.legend(fontsize=8, frameon=False)
            axis.grid(alpha=0.25)
            axis.tick_params(labelsize=8)
            _open(axis)
        for axis in axes[1:]:
            axis.set_ylim(0, 1.05)
            axis.set_xticks([0, 15, 30, 45, 60, 75, 90])
    figure.suptitle(_shortened(name), fontsize=12)
    return _png(figure)


def polar_slices(result: Result) -> bytes:
    """f_r in the plane of incidence: luminance on a logarithmic radius, data and models."""
    luminance = result.slices @ LUMINANCE
    figure = Figure(figsize=SLICES_SIZE)
    for index, theta_i in enumerate(INCIDENCE):
        data, *models = luminance[:, index]
        top = np.log10(np.nanmax(data)) + 0.2
        bottom = max(np.log10(data[data > 0].min()) - 0.5, top - DECADES)
        axes = figure.add_axes(_square(index), projection="polar")
        _half_disc(axes, theta_i, bottom, top)
        axes.plot(THETA_O, _limited(data, bottom, top), color="0.7", lw=5, zorder=2)
        for contender, values in zip(CONTENDERS, models, strict=True):
            line = _limited(values, bottom, top)
            axes.plot(THETA_O, line, color=contender.color, lw=1.2, zorder=3)
    handles = [Line2D([], [], color="0.7", lw=5, label="Data")]
    handles += [Line2D([], [], color=c.color, lw=1.5, label=c.label) for c in CONTENDERS]
    handles += [
        Line2D([], [], color="0.35", ls="--", lw=1, label="light"),
        Line2D([], [], color="0.35", ls=":", lw=1, label="mirror direction"),
        Line2D([], [], color=GRAZING_COLOR, lw=7, label=f"grazing, beyond {GRAZING}°"),
    ]
    figure.legend(handles=handles, loc="lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(f"{_shortened(result.name)}: f in 1/sr in the plane of incidence", fontsize=12)
    return _png(figure)


def _square(index: int) -> tuple[float, float, float, float]:
    """Place of the slices' axes, two in a row.

    Polar axes are square even where half of the disc is shown, so the empty quarters at the top
    and at the bottom overlap.
    """
    width = 0.42
    height = width * SLICES_SIZE[0] / SLICES_SIZE[1]
    left, middle = (0.04, 0.54)[index % 2], (0.73, 0.315)[index // 2]
    return left, middle - height / 2, width, height


def _half_disc(axes: Axes, theta_i: float, bottom: float, top: float) -> None:
    """Axes for log10 f between bottom and top: grazing wedges, directions of light and mirror."""
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamin(-90)
    axes.set_thetamax(90)
    axes.set_thetagrids([-80, -60, -30, 0, 30, 60, 80])
    axes.set_ylim(bottom, top)
    decades = np.arange(np.ceil(bottom), top)
    decades = decades[:: 2 if len(decades) > 3 else 1]
    axes.set_yticks(decades, [f"$10^{{{d:.0f}}}$" for d in decades])
    axes.tick_params(labelsize=8)
    axes.set_title(f"light at {np.degrees(theta_i):.0f}°", fontsize=10, y=0.8)
    for sign in (-1, 1):
        wedge = np.radians(sign * np.linspace(GRAZING, 90, 12))
        axes.fill_between(wedge, bottom, top, color=GRAZING_COLOR, lw=0, zorder=0)
    for angle, style in ((-theta_i, "--"), (theta_i, ":")):
        axes.plot([angle, angle], [bottom, top], color="0.35", ls=style, lw=0.9, zorder=1)
    axes.grid(alpha=0.35)


def _displayed(pictures: np.ndarray) -> np.ndarray:
    """Display values (n, height, width, 3) in 0..1, exposed by the first; NaN stays NaN."""
    inside = ~np.isnan(pictures[0, ..., 0])
    out = np.full(pictures.shape, np.nan)
    for picture, linear in zip(out, pictures, strict=True):
        picture[inside] = display(linear[inside].astype(np.float64), pictures[0][inside])
    return out


def _show(axes: Axes, picture: np.ndarray) -> None:
    image = np.clip(np.where(np.isnan(picture), BACKDROP, picture), 0, 1)
    axes.imshow(image, interpolation="bicubic")
    axes.set_facecolor([BACKDROP] * 3)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def _limited(values: np.ndarray, bottom: float, top: float) -> np.ndarray:
    """log10 between bottom and top; NaN stays NaN."""
    return np.log10(np.clip(values, 10.0**bottom, 10.0**top))


def _signed_sqrt(x: np.ndarray) -> np.ndarray:
    # matplotlib also asks for values a little left of zero
    return np.sign(x) * np.sqrt(np.abs(x))


def _shortened(name: str) -> str:
    """A name for a chart: not too long, and nothing that matplotlib takes for mathematics."""
    short = name if len(name) <= 28 else f"{name[:27]}…"
    return short.replace("$", r"\$")


def _open(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    # without the default metadata, which names the version of matplotlib
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()
