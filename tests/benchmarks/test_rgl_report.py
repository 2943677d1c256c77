# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks import rgl_report


def row(material, fit_mean):
    figures = {"objective": 0.01, "bins_usable": 1000, "bins_clamped": 250}
    keys = [key for _, key, _ in rgl_report.COLUMNS]
    return {"material": material, "fit": figures, **{key: [30.0, 40.0] for key in keys}} | {
        "fit_mean": fit_mean
    }


@pytest.mark.parametrize(
    ("values", "met"),
    [
        ([[38, 40], [36, 38]], [True, True]),
        ([[38, 40], [30, 32]], [False, True]),
        ([[58, 60], [28, 29]], [True, False]),
    ],
)
def test_targets(values, met):
    rows = [row(str(number), value) for number, value in enumerate(values)]
    assert [check.ok for check in rgl_report.checks(rows)] == met


def test_worst_material_is_named():
    rows = [row("good", [50, 50]), row("bad", [20, 30])]
    assert "25.0 dB (bad)" in rgl_report.checks(rows)[1].text


def test_markdown_has_every_material_and_the_mean():
    rows = [row("a", [30, 40]), row("b", [40, 50])]
    text = rgl_report.markdown(rows, rgl_report.checks(rows), 64)
    table = [line for line in text.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in table}) == 1
    assert table[2].startswith("| a | 1.00e-02 | 25% | 30.0 / 40.0 |")
    assert table[-1].startswith("| mean of 2 |  |  | 35.0 / 45.0 |")


def test_rows_without_renders():
    rows = [{k: v for k, v in row("a", [30, 40]).items() if k in ("material", "fit", "fit_mean")}]
    text = rgl_report.markdown(rows, rgl_report.checks(rows), 64)
    assert "native" not in text
    assert "fit, mean 35.0" in rgl_report.line(rows[0])


def test_sheet():
    """Two maps of three columns; equal pictures have a grey difference, and no map is visible."""
    pictures = {
        "mitsuba": np.full((2, 2, 44, 44, 3), 0.5),
        "native": np.stack([np.full((2, 44, 44, 3), 0.5), np.full((2, 44, 44, 3), 0.7)]),
    }
    sheet = rgl_report.sheet({"a": pictures, "b": pictures})
    assert sheet.shape == (88, 6 * 44, 3)
    shown = sheet ** (1 / 2.2)
    np.testing.assert_allclose(shown[0, 0], rgl_report.BACKDROP)
    middle = shown[22, 22::44]
    np.testing.assert_allclose(middle[2], 0.5)
    assert (middle[5] > 0.7).all()
    np.testing.assert_allclose(middle[0], middle[1])
