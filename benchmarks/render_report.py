# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables, medians and targets of ./nfm bench render."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from dataclasses import dataclass

from .lights import LIGHTS

PRINCIPLED = "principled"

MATERIALS = {
    "matte": ("pink-fabric", "blue-rubber"),
    "plastic": ("red-specular-plastic", "violet-acrylic"),
    "paint": ("silver-metallic-paint", "red-metallic-paint"),
    "metal": ("aluminium", "nickel"),
}

MAPS = tuple(light.name for light in LIGHTS.values() if light.environment)
MISSING_LIGHT = -0.05  # relative mean error under the zero-radius lamp from which light is missing

HEADER = (
    f"  {'light':<8}{'sampling':<12}{'RMSE':>9}{'ratio':>8}{'p99.9':>9}{'largest':>9}{'s':>7}"
    f"{'ratio':>7}{'efficiency':>11}{'mean %':>9}{'L1 %':>13}"
)

LEGEND = """\
RMSE, p99.9: of a picture with so many samples, over the mean of the converged picture
largest: pixel over its own converged value or, if that is less, over 1 % of the mean
s: CPU seconds less those of a picture with one sample
ratio: to Principled; efficiency: 1 / (MSE x seconds) over Principled's
mean, L1: error of the converged picture against numpy, L1 between the bounds that its noise leaves;
  with large fireflies neither means much, since most pixels have not met theirs yet
(*): light is missing, since mirrors cannot see a lamp of zero radius; nothing to compare"""


@dataclass(frozen=True)
class Check:
    """A target. ok is None where the noise leaves it open."""

    label: str
    shown: str
    ok: bool | None


def class_of(material: str) -> str:
    """Class of a material of the default set, or other."""
    return next((name for name, group in MATERIALS.items() if material in group), "other")


def add_ratios(row: dict, beside: dict) -> None:
    """Complete a row with its ratios to Principled's row of the same material and light."""
    row["missing_light"] = row["light"] == "zero" and row.get("mean_error", 0) < MISSING_LIGHT
    row["rmse_ratio"] = _ratio(row["rmse"], beside["rmse"])
    row["seconds_ratio"] = _ratio(row["seconds"], beside["seconds"])
    row["efficiency"] = _ratio(1.0, row["rmse_ratio"] ** 2 * row["seconds_ratio"])


def row_line(row: dict) -> str:
    """One line of the printed table."""
    error = mean = ""
    if "error" in row:
        error = "{:.2f}-{:.2f}".format(*(100 * bound for bound in row["error"]))
        mean = f"{100 * row['mean_error']:+.2f}"
    ratio, efficiency, star = f"{row['rmse_ratio']:.2f}", f"{row['efficiency']:.3g}", ""
    if row["missing_light"]:
        ratio, efficiency, star = "-", "-", " (*)"
    return (
        f"  {row['light']:<8}{row['sampling']:<12}{row['rmse']:9.4f}{ratio:>8}"
        f"{row['p999']:9.3f}{row['largest']:9.1f}{row['seconds']:7.2f}{row['seconds_ratio']:7.2f}"
        f"{efficiency:>11}{mean:>9}{error:>13}{star}"
    )


def summary_lines(rows: list[dict]) -> list[str]:
    """Medians over the materials, by sampling and light."""
    lines = [
        "medians over the materials (largest, L1: over all of them)",
        f"  {'light':<8}{'sampling':<12}{'RMSE':>9}{'ratio':>8}{'p99.9':>9}{'largest':>9}"
        f"{'ratio s':>9}{'efficiency':>11}{'L1 %':>14}",
    ]
    for light, sampling, group in _groups(rows):
        rmse, ratio, p999, largest, seconds, efficiency, error = _medians(group)
        lines.append(
            f"  {light:<8}{sampling:<12}{rmse:>9}{ratio:>8}{p999:>9}{largest:>9}"
            f"{seconds:>9}{efficiency:>11}{error:>14}"
        )
    return lines


def checks(rows: list[dict]) -> list[Check]:
    """The targets that concern the samplings and lights that were run."""
    everywhere = tuple(LIGHTS)
    found = [
        # under the zero-radius lamp only the jitter of the rays within a pixel is left, so that
        # the sharpness of the highlight decides
        _ratio_check(rows, "native", tuple(n for n in LIGHTS if n != "zero"), "rmse_ratio", 1.3),
        _ratio_check(rows, "native", ("zero",), "rmse_ratio", 1.3),
        _ratio_check(rows, "native", everywhere, "seconds_ratio", 2.0),
        _ratio_check(rows, "smooth", MAPS, "rmse_ratio", 1.3),
        _ratio_check(rows, "smooth", ("lamp",), "rmse_ratio", 3.0),
        _ratio_check(rows, "smooth", everywhere, "seconds_ratio", 3.0),
        _ratio_check(rows, "exact", MAPS, "rmse_ratio", 2.0),
        _ratio_check(rows, "exact", everywhere, "seconds_ratio", 3.0),
        _below_reference(rows, 20.0),
        *(_largest_check(rows, sampling, 50.0) for sampling in ("native", "smooth")),
        _error_check(rows, "native", ("matte", "plastic"), 1.0),
        _error_check(rows, "native", ("paint", "metal"), 2.0),
        _error_check(rows, "smooth", tuple(MATERIALS), 0.5),
    ]
    return [check for check in found if check]


def check_lines(found: list[Check]) -> list[str]:
    """Targets as printed lines."""
    word = {True: "ok    ", False: "MISSED", None: "open  "}
    return [f"  {word[check.ok]} {check.label}: {check.shown}" for check in found]


def markdown(rows: list[dict], matches: dict[str, dict], found: list[Check], title: str) -> str:
    """The file docs/results/render.md."""
    lines = [
        "# Noise, speed and error of the samplings",
        "",
        "Written by `./nfm bench render --markdown docs/results/render.md`; the protocol is in",
        "[RESULTS.md](../RESULTS.md) and `benchmarks/render.py`.",
        f"{title}.",
        "",
        "## Targets",
        "",
        "| target | measured | |",
        "|---|---|---|",
    ]
    word = {True: "met", False: "**missed**", None: "open: noise"}
    lines += [f"| {check.label} | {check.shown} | {word[check.ok]} |" for check in found]
    if not found:
        lines.append("| none of them concerns the samplings that were run | | |")
    lines += ["", "## Ratios to Principled", ""]
    lines += [
        "Medians over the materials; *largest* and *L1* are those of the worst. No ratio where",
        "light is missing: mirrors cannot see a lamp of zero radius.",
        "",
    ]
    lines += _ratio_table(rows)
    classes = [name for name in (*MATERIALS, "other") if any(r["class"] == name for r in rows)]
    for name in classes:
        lines += ["", f"### {name.capitalize()}", ""]
        lines += _ratio_table([row for row in rows if row["class"] == name])
    lines += ["", "## The matched Principled", ""]
    lines += [
        "| material | metallic | roughness | base colour | IOR | specular tint | error |",
        "|---|---:|---:|---|---:|---|---:|",
    ]
    for name, match in matches.items():
        lines.append(
            f"| {name} | {match['metallic']:.0f} | {match['roughness']:.3f} "
            f"| {_color(match['base_color'])} | {match['ior']:.3f} "
            f"| {_color(match['specular_tint'])} | {match['error']:.2f} |"
        )
    lines += ["", "## All figures", "", "```"]
    for name in dict.fromkeys(row["material"] for row in rows):
        lines += [name, HEADER, *(row_line(row) for row in rows if row["material"] == name), ""]
    return "\n".join([*lines, LEGEND, "```", ""])


def _ratio_table(rows: list[dict]) -> list[str]:
    lines = [
        "| light | sampling | RMSE | ratio | p99.9 | largest | time ratio | efficiency | L1 % |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for light, sampling, group in _groups(rows):
        lines.append(f"| {' | '.join((LIGHTS[light].title, sampling, *_medians(group)))} |")
    return lines


def _medians(group: list[dict]) -> tuple[str, ...]:
    """RMSE and its ratio, p99.9, largest, ratio of time, efficiency, worst L1 error, as text.

    Medians over the rows that show all the light, - where there are none.
    """
    complete = _complete(group)

    def median(key: str, form: str) -> str:
        return format(statistics.median(row[key] for row in complete), form) if complete else "-"

    errors = [[100 * bound for bound in row["error"]] for row in group if "error" in row]
    worst = max(errors, key=lambda error: error[1], default=())
    return (
        median("rmse", ".3g"),
        median("rmse_ratio", ".2f"),
        median("p999", ".2g"),
        f"{max(row['largest'] for row in complete):.1f}" if complete else "-",
        f"{statistics.median(row['seconds_ratio'] for row in group):.2f}",
        median("efficiency", ".2g"),
        "-".join(f"{bound:.2f}" for bound in worst),
    )


def _ratio_check(
    rows: list[dict], sampling: str, lights: tuple[str, ...], key: str, bound: float
) -> Check | None:
    """The median ratio to Principled under the light where it is largest."""
    medians = {
        light: statistics.median(row[key] for row in group)
        for light, name, group in _groups(_complete(rows))
        if name == sampling and light in lights
    }
    if not medians:
        return None
    worst = max(medians, key=medians.get)
    what = {"rmse_ratio": "RMSE", "seconds_ratio": "time"}[key]
    where = "all lights" if set(lights) == set(LIGHTS) else ", ".join(lights)
    return Check(
        f"{sampling}: median {what} at most {bound:g} x Principled, {where}",
        f"{medians[worst]:.3g} ({worst})",
        medians[worst] <= bound,
    )


def _below_reference(rows: list[dict], bound: float) -> Check | None:
    lamp = {(r["material"], r["sampling"]): r["rmse"] for r in rows if r["light"] == "lamp"}
    ratios = [
        lamp[name, "reference"] / lamp[name, "exact"]
        for name, sampling in lamp
        if sampling == "exact" and (name, "reference") in lamp
    ]
    if not ratios:
        return None
    ratio = statistics.median(ratios)
    return Check(
        f"exact: median RMSE at least {bound:g} x below reference's, lamp",
        f"{ratio:.1f}",
        ratio >= bound,
    )


def _largest_check(rows: list[dict], sampling: str, bound: float) -> Check | None:
    group = [row for row in rows if row["sampling"] == sampling and row["light"] in MAPS]
    if not group:
        return None
    worst = max(group, key=lambda row: row["largest"])
    return Check(
        f"{sampling}: no pixel over {bound:g} x its converged value under the maps",
        f"{worst['largest']:.1f} ({worst['material']}, {worst['light']})",
        worst["largest"] <= bound,
    )


def _error_check(
    rows: list[dict], sampling: str, classes: tuple[str, ...], bound: float
) -> Check | None:
    """The largest L1 error under the maps; open where its bounds enclose the target."""
    group = [
        row
        for row in rows
        if row["sampling"] == sampling
        and row["light"] in MAPS
        and row["class"] in classes
        and "error" in row
    ]
    if not group:
        return None
    lower = max(group, key=lambda row: row["error"][0])
    upper = max(group, key=lambda row: row["error"][1])
    ok = False if 100 * lower["error"][0] > bound else None
    ok = True if 100 * upper["error"][1] <= bound else ok
    worst = upper if ok else lower
    return Check(
        f"{sampling}: image L1 error at most {bound:g} % under the maps, {', '.join(classes)}",
        f"largest between {100 * lower['error'][0]:.2f} and {100 * upper['error'][1]:.2f} "
        f"({worst['material']}, {worst['light']})",
        ok,
    )


def _groups(rows: list[dict]) -> Iterable[tuple[str, str, list[dict]]]:
    """Rows by light and sampling, in the order of the rows."""
    keys = dict.fromkeys((row["light"], row["sampling"]) for row in rows)
    for light in LIGHTS:
        for key in keys:
            if key[0] == light:
                yield *key, [row for row in rows if (row["light"], row["sampling"]) == key]


def _complete(rows: list[dict]) -> list[dict]:
    return [row for row in rows if not row["missing_light"]]


def _ratio(value: float, beside: float) -> float:
    return value / beside if beside > 0 else float("inf")


def _color(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.3f}" for value in values)
