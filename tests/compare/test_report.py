# SPDX-License-Identifier: GPL-3.0-or-later
import sys
from types import SimpleNamespace

import pytest

import compare
from compare import report
from compare.document import Picture, Strong, Table
from compare.models import Settings
from compare.report import Content
from fitter.errors import NfmError
from tests.compare.test_document import Parsed


@pytest.fixture(autouse=True)
def figures(monkeypatch):
    """Stand-ins for the drawings, which have tests of their own; matplotlib may be missing."""
    drawings = SimpleNamespace(
        DIFFERENCE_GAIN=8,
        psnr_chart=lambda results: b"chart",
        picture_sheet=lambda result, scenes: b"sheet",
        factor_curves=lambda name, factors: b"curves",
        polar_slices=lambda result: b"slices",
    )
    monkeypatch.setitem(sys.modules, "compare.figures", drawings)
    monkeypatch.setattr(compare, "figures", drawings, raising=False)


@pytest.fixture
def make_content(make_result):
    def make(results=None, scenes=("sphere in Grace", "Buddha in Grove"), curves=(), notes=()):
        if results is None:
            results = [
                make_result("tin", psnr=(50, 45, 52, 30)),
                make_result("lead", psnr=(40, 42, 30, 20)),
                make_result("gold", psnr=(60, 30, 40, 35)),
            ]
        return Content(results, scenes, notes, Settings("log"), curves)

    return make


def tables_of(content):
    return [block for block in report.tables(content) if isinstance(block, Table)]


def test_order_is_that_of_independent_g(make_content):
    content = make_content()
    assert [result.name for result in content.ordered] == ["gold", "lead", "tin"]
    _, psnr, errors = tables_of(content)
    assert [row[0] for row in psnr.rows] == ["gold", "lead", "tin"]
    assert [row[0] for row in errors.rows] == ["gold", "lead", "tin"]


def test_psnr_of_every_model_and_scene(make_content):
    _, table, _ = tables_of(make_content())
    assert table.rows[0][1:] == [
        "60.0 / 61.0",
        "30.0 / 31.0",
        "40.0 / 41.0",
        "35.0 / 36.0",
        "+30.0",
    ]
    best = [[isinstance(cell, Strong) for cell in row].index(True) for row in table.rows]
    assert best == [1, 2, 3]
    assert [row[-1] for row in table.rows] == ["+30.0", "-2.0", "+5.0"]


def test_best_errors_are_bold(make_content):
    *_, table = tables_of(make_content())
    row = table.rows[0]
    assert len(row) == len(table.header) == 13
    assert [n for n, cell in enumerate(row) if isinstance(cell, Strong)] == [1, 5, 9]


def test_gains(make_content):
    against_g, against_table, against_analytic = report.gains(make_content())
    assert "Independent-G: better on 2 of 3 (67%), mean gain +11.0 dB" in against_g
    assert "Bivariate: better on 2 of 3 (67%), mean gain +9.3 dB" in against_table
    assert "Principled: better on 3 of 3 (100%), mean gain +21.7 dB" in against_analytic


def test_summary(make_content):
    summary = tables_of(make_content())[0]
    assert summary.rows[0] == [
        "Three lobes",
        "822",
        "1.5",
        "1.00e-03",
        "0.0100",
        "50.5 dB",
        "50.5 dB",
        "40.5 dB",
    ]
    text = report.summary_text(make_content(notes=["There is no Buddha."]))
    assert "Three lobes    rendered PSNR mean  50.5 dB, smallest  40.5" in text
    assert "There is no Buddha." in text


def test_without_scenes(make_content, make_result):
    """Only what needs pictures is left out; the objective orders the materials."""
    results = [
        make_result("good", objective=1e-4, n_scenes=0),
        make_result("bad", objective=1e-2, n_scenes=0),
    ]
    content = make_content(results, scenes=(), notes=["There is no sphere."])
    text = report.tables_as_markdown(content)
    assert "There is no sphere." in text
    assert "rendered PSNR" not in text.partition("## Protocol")[0]
    assert [result.name for result in content.ordered] == ["bad", "good"]
    assert report.summary_text(content) == "There is no sphere.\n"


def test_protocol_names_the_weight_and_the_kind_of_fit(make_content, make_result):
    text = report.tables_as_markdown(make_content())
    assert "under the weight log" in text
    assert "with the starts, sweeps and joint steps of the three lobes" in text
    golden = Content([make_result()], ["a"], [], Settings("log", golden_section=True), [])
    assert "golden-section" in report.tables_as_markdown(golden)


def test_best_and_worst_are_shown(make_content, make_result):
    names = ["a", "b", "c", "d", "e", "f"]
    results = [make_result(name, psnr=(50 + n, 1, 1, 1)) for n, name in enumerate(names)]
    pictures = [
        block.caption
        for block in report.pictures(make_content(results))
        if isinstance(block, Picture) and block.file_name.startswith("pictures-")
    ]
    assert [caption.partition(":")[0] for caption in pictures] == [
        "f, among the best",
        "e, among the best",
        "a, among the worst",
        "b, among the worst",
    ]


def test_written_report_is_whole(make_content, make_result, tmp_path):
    name = '"><img src=x onerror=alert(1)>|`'
    content = make_content([make_result(name), make_result("tin")], curves=[name])
    report.write(content, tmp_path)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = Parsed(text)
    assert name in page.text
    assert not any(attribute == "onerror" for _, attribute, _ in page.attributes)
    sources = [value for _, attribute, value in page.attributes if attribute == "src"]
    assert len(sources) == 6  # a chart, two sheets, one set of factors, two slices
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    markdown = (tmp_path / "report.md").read_text(encoding="utf-8")
    images = sorted(path.name for path in (tmp_path / "images").iterdir())
    assert len(images) == 6
    assert all(f"](images/{image})" in markdown for image in images)
    assert "onerror=alert(1)\\>\\|\\`" in markdown


def test_names_of_images_are_plain_and_unique(make_result):
    results = [make_result(name) for name in ("../a b", "A-B", "äöü", "a" * 60)]
    slugs = [report._slug(result) for result in results]
    assert len(set(slugs)) == 4
    assert all(set(slug) <= set("abcdefghijklmnopqrstuvwxyz0123456789-") for slug in slugs)


def test_folder_that_cannot_be_written(make_content, tmp_path):
    (tmp_path / "images").write_text("in the way")
    with pytest.raises(NfmError, match="cannot be written"):
        report.write(make_content(), tmp_path)
