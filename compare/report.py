# SPDX-License-Identifier: GPL-3.0-or-later
"""What a report says: tables and pictures of all results, in report.md and report.html."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitter.errors import NfmError, shown_name
from fitter.files import write_atomically
from fitter.pictures.sphere import EXPOSURE

from . import scenes as scene_module
from .document import (
    Block,
    Bullets,
    Heading,
    Paragraph,
    Picture,
    Strong,
    Table,
    to_html,
    to_markdown,
)
from .grading import Grades, Result
from .models import CONTENDERS, INDEPENDENT_G, OURS, Settings

IMAGES = "images"

# How many of the best and of the worst pictures are shown.
EXTREMES = 2


@dataclass(frozen=True)
class Content:
    """What a report is made of.

    scenes : names, in the order of Result.pictures
    notes : what else the reader must know, such as a scene that is missing
    curves : names of the materials whose factors are drawn
    """

    results: Sequence[Result]
    scenes: Sequence[str]
    notes: Sequence[str]
    settings: Settings
    curves: Sequence[str]

    @property
    def ordered(self) -> list[Result]:
        """The results as fig. 3 of Peng et al. 2017 has them, by what Independent-G reaches."""
        return sorted(self.results, key=lambda r: _quality(r.grades[INDEPENDENT_G]))


def write(content: Content, folder: Path) -> None:
    """Write report.md with its images and report.html into the folder.

    Raises
    ------
    NfmError
        Something cannot be written.
    """
    blocks = [*tables(content), *pictures(content), *protocol(content)]
    try:
        (folder / IMAGES).mkdir(exist_ok=True)
        for block in blocks:
            if isinstance(block, Picture):
                write_atomically(folder / IMAGES / block.file_name, [block.png])
        write_atomically(folder / "report.md", [to_markdown(blocks, IMAGES).encode()])
        write_atomically(folder / "report.html", [to_html(blocks).encode()])
    except OSError as error:
        raise NfmError(
            f"{shown_name(folder)}: cannot be written ({error.strerror or error}); choose another"
        ) from error


def tables_as_markdown(content: Content) -> str:
    """The tables and the protocol without pictures."""
    return to_markdown([*tables(content), *protocol(content)], IMAGES)


def tables(content: Content) -> list[Block]:
    """Title, summary and the figures of every material."""
    n = len(content.results)
    blocks: list[Block] = [
        Heading(1, f"Comparison of models on {n} material{'s' if n > 1 else ''}"),
        *map(Paragraph, content.notes),
        Heading(2, "Summary"),
        _summary_table(content),
    ]
    if content.scenes:
        blocks.append(Bullets(gains(content)))
    blocks.append(Heading(2, "Every material"))
    if content.scenes:
        text = f"Rendered PSNR in dB, {' / '.join(content.scenes)}; the best mean is bold."
        blocks += [Paragraph(text), _psnr_table(content)]
    text = "Objective, mean log error and numeric PSNR over the data; the best is bold."
    return [*blocks, Paragraph(text), _error_table(content)]


def pictures(content: Content) -> list[Block]:
    """Charts, renderings, factors and slices."""
    # matplotlib is not there where only the tables are wanted
    from . import figures

    blocks: list[Block] = []
    chosen = {result.name: result for result in content.results if result.name in content.curves}
    if content.scenes:
        chart = figures.psnr_chart(content.ordered)
        caption = (
            f"Mean rendered PSNR over {' and '.join(content.scenes)}, materials in the order of "
            "Independent-G, as in fig. 3 of Peng et al. 2017."
        )
        blocks += [Heading(2, "Rendered PSNR"), Picture("psnr.png", chart, caption)]
        blocks.append(Heading(2, "Best and worst pictures of the three lobes"))
        for label, result in _extremes(content.results):
            sheet = figures.picture_sheet(result, content.scenes)
            caption = (
                f"{result.name}, {label}: {result.grades[OURS].mean_psnr:.1f} dB. Differences are "
                f"shown {figures.DIFFERENCE_GAIN} times as bright as they are."
            )
            blocks.append(Picture(f"pictures-{_slug(result)}.png", sheet, caption))
    if chosen:
        blocks.append(Heading(2, "Factors"))
        text = (
            "Each factor has its maximum at 1; the energy is in the scales, which are not shown. "
            "A factor means nothing where another one of its lobe is zero."
        )
        blocks.append(Paragraph(text))
        for result in chosen.values():
            chart = figures.factor_curves(result.name, result.factors)
            caption = f"Factors of {result.name}, as in fig. 5 of Peng et al. 2017."
            blocks.append(Picture(f"factors-{_slug(result)}.png", chart, caption))
    blocks.append(Heading(2, "Slices"))
    shown = {result.sha256: result for result in chosen.values()}
    shown |= {result.sha256: result for _, result in _extremes(content.results)}
    for result in shown.values():
        chart = figures.polar_slices(result)
        caption = (
            f"{result.name}: luminance of f over theta_o in the plane of incidence, on a "
            "logarithmic radius. There is no data where the grey line ends."
        )
        blocks.append(Picture(f"slices-{_slug(result)}.png", chart, caption))
    return blocks


def protocol(content: Content) -> list[Block]:
    """How the figures came about."""
    independent_g = (
        "alternating least squares with the golden-section step for G of Bagher et al. 2016"
        if content.settings.golden_section
        else "with the starts, sweeps and joint steps of the three lobes"
    )
    counts = {c.key: content.results[0].grades[c.key].n_parameters for c in CONTENDERS}
    items = [
        "The data are the files as a MERL reader looks them up, at the nearest bin. Where they are "
        "not measurements but fits of some, that is what the models are compared on.",
        f"Every model is fitted to the same bins under the weight {content.settings.weight}, "
        f"with the effort {content.settings.quality}. Three "
        f"lobes: the model of this project, {counts['shared3']} numbers. Independent-G: a lobe for "
        f"each channel, {counts['independent-g']} numbers, {independent_g}. Bivariate: a table "
        f"over theta_h and theta_d for each channel, {counts['bivariate']:,} numbers. Principled: "
        f"Lambert and one GGX lobe with coloured f0 and f90, {counts['principled']} numbers.",
        "The last joint steps of the three lobes and of Independent-G see, beside the values, the "
        "directional albedo and pictures under synthetic environments, which have nothing to do "
        "with the scenes. Bivariate and Principled see the values alone.",
        "Objective: eq. 2 of Peng et al. 2017 relative to the data, with exact angles. Mean log "
        "error: of f cos theta_i + 0.001, over bins by solid angle. Numeric PSNR: of the values "
        "over all valid bins, the peak is the largest measured value; sharp highlights decide it. "
        "Seconds: CPU time of the fit.",
        f"Rendered PSNR: a sphere ({scene_module.SPHERE_HEIGHT} pixels high) and a mesh "
        f"({scene_module.MESH_HEIGHT}), orthographic, one ray through each pixel's centre; the map "
        "is box-filtered to 128 x 64 texels that are summed exactly, without shadows, so there is "
        "no noise; every model is looked up at the nearest bin of the MERL grid, as the data. "
        f"Exposure so that the data's mean is {EXPOSURE}, clipped at 1, gamma 2.2, peak 1, object "
        "pixels only. A mean over scenes or materials is a mean of dB.",
    ]
    return [Heading(2, "Protocol"), Bullets(items)]


def gains(content: Content) -> list[str]:
    """How often and by how much the three lobes win in mean rendered PSNR."""
    lines = []
    for contender in CONTENDERS:
        if contender.key == OURS:
            continue
        gain = np.array(
            [
                result.grades[OURS].mean_psnr - result.grades[contender.key].mean_psnr
                for result in content.results
            ]
        )
        low, middle, high = np.percentile(gain, [10, 50, 90])
        lines.append(
            f"Three lobes against {contender.label}: better on {(gain > 0).sum()} of {gain.size} "
            f"({(gain > 0).mean():.0%}), mean gain {gain.mean():+.1f} dB "
            f"(10 / 50 / 90 %: {low:+.1f} / {middle:+.1f} / {high:+.1f})"
        )
    return lines


def summary_text(content: Content) -> str:
    """The summary for a terminal."""
    lines = []
    if content.scenes:
        for contender in CONTENDERS:
            values = [r.grades[contender.key].mean_psnr for r in content.results]
            lines.append(
                f"{contender.label:<14} rendered PSNR mean {np.mean(values):5.1f} dB, "
                f"smallest {min(values):5.1f}"
            )
        lines += gains(content)
    return "".join(f"{line}\n" for line in [*lines, *content.notes])


def _summary_table(content: Content) -> Table:
    header = ["model", "numbers", "median CPU s", "median objective", "median log error"]
    if content.scenes:
        header += ["mean rendered PSNR", "median", "smallest"]
    rows = []
    for contender in CONTENDERS:
        grades = [result.grades[contender.key] for result in content.results]
        row = [
            contender.label,
            f"{grades[0].n_parameters:,}",
            f"{np.median([g.seconds for g in grades]):.1f}",
            f"{np.median([g.objective for g in grades]):.2e}",
            f"{np.median([g.mean_log_error for g in grades]):.4f}",
        ]
        if content.scenes:
            psnr = [g.mean_psnr for g in grades]
            row += [f"{value:.1f} dB" for value in (np.mean(psnr), np.median(psnr), min(psnr))]
        rows.append(row)
    return Table(header, rows)


def _psnr_table(content: Content) -> Table:
    header = ["material", *(contender.label for contender in CONTENDERS), "gain"]
    rows = []
    for result in content.ordered:
        cells = [
            " / ".join(f"{value:.1f}" for value in result.grades[c.key].rendered_psnr)
            for c in CONTENDERS
        ]
        means = [result.grades[c.key].mean_psnr for c in CONTENDERS]
        cells[int(np.argmax(means))] = Strong(cells[int(np.argmax(means))])
        gain = result.grades[OURS].mean_psnr - result.grades[INDEPENDENT_G].mean_psnr
        rows.append([result.name, *cells, f"{gain:+.1f}"])
    return Table([*header[:-1], "gain over Independent-G"], rows)


def _error_table(content: Content) -> Table:
    figures = (
        ("objective", lambda grades: grades.objective, "{:.2e}", min),
        ("log error", lambda grades: grades.mean_log_error, "{:.4f}", min),
        ("numeric PSNR", lambda grades: grades.numeric_psnr, "{:.1f}", max),
    )
    header = ["material"]
    for title, *_ in figures:
        header += [f"{title}, {contender.label}" for contender in CONTENDERS]
    rows = []
    for result in content.ordered:
        row = [result.name]
        for _, figure, text, best in figures:
            values = [figure(result.grades[contender.key]) for contender in CONTENDERS]
            cells = [text.format(value) for value in values]
            cells[values.index(best(values))] = Strong(cells[values.index(best(values))])
            row += cells
        rows.append(row)
    return Table(header, rows)


def _extremes(results: Sequence[Result]) -> list[tuple[str, Result]]:
    """The best and the worst of our model, each once, with what to call them."""
    ranked = sorted(results, key=lambda r: _quality(r.grades[OURS]))
    worst, best = ranked[:EXTREMES], ranked[::-1][:EXTREMES]
    labelled = [("among the best", r) for r in best if r not in worst or len(ranked) == 1]
    return labelled + [
        ("among the worst", r) for r in worst if ("among the best", r) not in labelled
    ]


def _quality(grades: Grades) -> float:
    """What orders materials: pictures, or the objective where there are none."""
    return grades.mean_psnr if grades.rendered_psnr else -grades.objective


def _slug(result: Result) -> str:
    """Part of a file name that is unique, whatever the material is called."""
    return f"{re.sub('[^a-z0-9]+', '-', result.name.lower()).strip('-')}-{result.sha256[:8]}"
