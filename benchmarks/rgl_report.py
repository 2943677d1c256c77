# SPDX-License-Identifier: GPL-3.0-or-later
"""What ./nfm bench rgl prints, writes and draws."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fitter.pictures.sphere import DISPLAY_GAMMA, display

# Heading, key of the row, what it is.
COLUMNS = (
    ("fit, mean", "fit_mean", "numpy: the fit against the mean of both directions"),
    ("fit, one-sided", "fit_one_sided", "numpy: the fit against the look-up of renderers"),
    ("file", "one_sided_mean", "numpy: the look-up of renderers against the mean"),
    ("native", "native", "the fit in Cycles, native sampling, against Mitsuba's original"),
    ("exact", "exact", "the fit in Cycles, exact sampling, against Mitsuba's original"),
    ("noise Mitsuba", "mitsuba_noise", "what is left of Mitsuba's noise, as PSNR"),
    ("noise native", "native_noise", "the same of native sampling"),
    ("noise exact", "exact_noise", "the same of exact sampling"),
)

MEAN_TARGET, SMALLEST_TARGET = 37.0, 29.0

# How much brighter differences are shown than they are.
DIFFERENCE_GAIN = 4

# Around the spheres, as a display value.
BACKDROP = 0.13


class Check(NamedTuple):
    """A target and whether it is met."""

    text: str
    ok: bool


def line(row: dict) -> str:
    """One material for a terminal."""
    cells = [f"{title} {np.mean(row[key]):.1f}" for title, key, _ in COLUMNS if key in row]
    return f"{row['material']:24} {'  '.join(cells)}"


def checks(rows: list[dict]) -> list[Check]:
    """The targets, over the means of both maps."""
    means = {row["material"]: float(np.mean(row["fit_mean"])) for row in rows}
    worst = min(means, key=means.get)
    mean = float(np.mean(list(means.values())))
    return [
        Check(f"mean {mean:.1f} dB, target {MEAN_TARGET:.0f}", mean >= MEAN_TARGET),
        Check(
            f"smallest {means[worst]:.1f} dB ({worst}), target {SMALLEST_TARGET:.0f}",
            means[worst] >= SMALLEST_TARGET,
        ),
    ]


def summary(rows: list[dict], found: list[Check]) -> list[str]:
    """Means over the materials and what became of the targets."""
    lines = ["", line({"material": f"mean of {len(rows)}", **_means(rows)})]
    return [*lines, *(f"{'met   ' if check.ok else 'MISSED'} {check.text}" for check in found)]


def markdown(rows: list[dict], found: list[Check], samples: int) -> str:
    """Every material in a table, for docs/results."""
    columns = [column for column in COLUMNS if column[1] in rows[0]]
    header = ["material", "objective", "clamped", *(title for title, *_ in columns)]
    lines = [
        "# Fits of RGL files",
        "Made by `./nfm bench rgl`; [RESULTS.md](../RESULTS.md) has the protocol. PSNR in dB, "
        f"Grace / Grove; renders have {samples} samples, "
        f"Mitsuba's 4 times as many. Clamped: usable bins of a colour out of "
        "gamut.",
        "\n".join(f"- *{title}*: {about}" for title, _, about in columns),
        "\n".join(
            [
                f"| {' | '.join(header)} |",
                f"| --- |{' ---: |' * (len(header) - 1)}",
                *(_markdown_row(row, columns) for row in rows),
                _markdown_row({"material": f"mean of {len(rows)}", **_means(rows)}, columns),
            ]
        ),
        "\n".join(f"- {check.text}: {'met' if check.ok else 'missed'}" for check in found),
    ]
    return "\n\n".join(lines) + "\n"


def sheet(shown: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
    """Linear picture of spheres: a row for each material, for each map three columns.

    Mitsuba's original, the fit in native sampling, and their difference as displayed, on grey.
    """
    rows = []
    for pictures in shown.values():
        cells = []
        for original, fit in zip(pictures["mitsuba"], pictures["native"], strict=True):
            cells += _cells(original.mean(0), fit.mean(0))
        rows.append(np.concatenate(cells, axis=1))
    return np.concatenate(rows) ** DISPLAY_GAMMA


def _cells(original: np.ndarray, fit: np.ndarray) -> list[np.ndarray]:
    """Display values (height, width, 3) of one material under one map."""
    height, width = original.shape[:2]
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    on_sphere = np.hypot(x, y) < height / 2.2
    original, fit = np.maximum(original, 0), np.maximum(fit, 0)
    reference = original[on_sphere]
    left, right = display(original, reference), display(fit, reference)
    difference = np.clip(0.5 + DIFFERENCE_GAIN * (right - left), 0, 1)
    return [np.where(on_sphere[..., None], c, BACKDROP) for c in (left, right, difference)]


def _means(rows: list[dict]) -> dict[str, list[float]]:
    return {
        key: np.mean([row[key] for row in rows], axis=0).tolist()
        for _, key, _ in COLUMNS
        if key in rows[0]
    }


def _markdown_row(row: dict, columns: list[tuple[str, str, str]]) -> str:
    fit = row.get("fit", {})
    cells = [
        row["material"],
        f"{fit['objective']:.2e}" if fit else "",
        f"{fit.get('bins_clamped', 0) / fit['bins_usable']:.0%}" if fit else "",
        *(" / ".join(f"{value:.1f}" for value in row[key]) for _, key, _ in columns),
    ]
    return f"| {' | '.join(cells)} |"
