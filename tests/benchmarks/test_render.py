import json

import pytest

from benchmarks import render_report
from benchmarks.__main__ import main
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS


def row(sampling, rmse, light="lamp", material="aluminium", **others):
    return {
        "material": material,
        "class": render_report.class_of(material),
        "light": light,
        "sampling": sampling,
        "mean": 1.0,
        "rmse": rmse,
        "p999": 0.1,
        "largest": 2.0,
        "seconds": 1.0,
        **others,
    }


def compared(*rows):
    for one in rows:
        render_report.add_ratios(one, rows[0])
    return list(rows)


def found(rows, words):
    checks = [c for c in render_report.checks(rows) if all(word in c.label for word in words)]
    assert len(checks) == 1, [c.label for c in checks]
    return checks[0]


@pytest.mark.parametrize(("rmse", "ok"), [(0.12, True), (0.14, False)])
def test_rmse_of_native_is_checked(rmse, ok):
    rows = compared(row("principled", 0.1), row("native", rmse))
    check = found(rows, ["native", "RMSE"])
    assert check.ok is ok
    assert check.shown == f"{10 * rmse:.3g} (lamp)"


def test_ratio_is_the_median_over_materials_under_the_worst_light():
    rows = []
    for light, ratios in {"lamp": (1, 2, 9), "area": (3, 4, 5)}.items():
        for material, ratio in zip(("nickel", "aluminium", "pink-fabric"), ratios, strict=True):
            rows += compared(
                row("principled", 0.1, light, material), row("native", ratio / 10, light, material)
            )
    assert found(rows, ["native", "RMSE"]).shown == "4 (area)"


def test_efficiency_is_by_squared_error_and_time():
    rows = compared(row("principled", 0.1), row("native", 0.2, seconds=3.0))
    assert rows[1]["efficiency"] == pytest.approx(1 / 12)


@pytest.mark.parametrize(("rmse", "ok"), [(0.04, True), (0.06, False)])
def test_exact_is_compared_with_reference(rmse, ok):
    rows = compared(row("principled", 0.1), row("reference", 1.0), row("exact", rmse))
    assert found(rows, ["exact", "reference"]).ok is ok


@pytest.mark.parametrize(("largest", "ok"), [(50, True), (51, False)])
def test_largest_pixel_is_over_all_materials_under_maps(largest, ok):
    rows = compared(
        row("principled", 0.1, "sun"),
        row("native", 0.1, "sun", largest=largest),
        row("native", 0.1, "lamp", largest=1e4),
    )
    assert found(rows, ["native", "pixel"]).ok is ok


@pytest.mark.parametrize(
    ("bounds", "ok"), [((0.001, 0.018), True), ((0.015, 0.025), None), ((0.021, 0.03), False)]
)
def test_error_is_open_where_the_noise_is_too_large(bounds, ok):
    rows = compared(
        row("principled", 0.1, "sun"), row("native", 0.1, "sun", error=bounds, mean_error=0.0)
    )
    assert found(rows, ["native", "L1", "metal"]).ok is ok


@pytest.fixture
def half_blind():
    """Native misses light on two of three materials, and is ten times as noisy there."""
    rows = []
    for material, missing in {"nickel": 0.0, "aluminium": -0.9, "pink-fabric": -0.9}.items():
        rmse = 1.0 if missing else 0.1
        rows += compared(
            row("principled", 0.1, "zero", material),
            row("native", rmse, "zero", material, mean_error=missing, error=(0.0, 0.1)),
        )
    return rows


def test_what_misses_the_light_is_marked_and_left_out(half_blind):
    natives = [one for one in half_blind if one["sampling"] == "native"]
    assert [one["missing_light"] for one in natives] == [False, True, True]
    assert found(half_blind, ["native", "RMSE", "zero"]).shown == "1 (zero)"
    assert ["(*)" in render_report.row_line(one) for one in natives] == [False, True, True]
    native = render_report.summary_lines(half_blind)[-1].split()
    assert native[:4] == ["zero", "native", "0.1", "1.00"]


def test_what_always_misses_the_light_has_no_ratio(half_blind):
    blind = [one for one in half_blind if one["material"] != "nickel"]
    native = render_report.summary_lines(blind)[-1].split()
    assert native[:4] == ["zero", "native", "-", "-"]


def test_dark_by_noise_is_not_missing_light():
    rows = compared(
        row("principled", 0.1), row("reference", 9.0, mean_error=-0.5, error=(0.1, 0.9))
    )
    assert not rows[1]["missing_light"]


@pytest.mark.parametrize("ground", [False, True])
def test_bench_render_writes_its_tables(ground, blender, shared, tmp_path, capsys):
    parameter_file.save(tmp_path / "nickel.nfm.json", FittedMaterial("nickel", MODELS["metal"]))
    options = ["render", "--quick", "--materials=nickel", "--samplings=reference"]
    options += ["--lights=lamp,zero", "--samples=4", "--resolution=32", "--converged-samples=8"]
    options += ["--points=16", *["--ground"][: int(ground)]]
    files = {name: tmp_path / name for name in ("json", "markdown", "pictures")}
    folders = [f"--{name}={path}" for name, path in files.items()]
    status = main([*options, f"--fits={tmp_path}", *folders])
    assert status == 0  # no target concerns these
    printed = capsys.readouterr().out
    assert "nickel (metal): Principled" in printed
    assert "(*)" in printed
    rows = json.loads(files["json"].read_text())["rows"]
    assert ["error" in r for r in rows] == [False, not ground] * 2
    assert [(r["light"], r["sampling"]) for r in rows] == [
        (light, sampling) for light in ("lamp", "zero") for sampling in ("principled", "reference")
    ]
    text = files["markdown"].read_text()
    assert "| nickel | 1 |" in text
    assert sorted(path.name for path in files["pictures"].iterdir()) == [
        "nickel-lamp.png",
        "nickel-zero.png",
    ]
