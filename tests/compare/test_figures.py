# SPDX-License-Identifier: GPL-3.0-or-later
"""That figures exist and show what they are given; what they look like is for people to judge."""

import io

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="matplotlib comes with the extra report")

from matplotlib.image import imread

from compare import figures

HOSTILE = "$\\frac{a}{$ <b>" + "long " * 20


@pytest.fixture(autouse=True)
def coarse_pictures(monkeypatch):
    """Fewer pixels, in less time."""
    monkeypatch.setattr(figures, "DPI", 60)


def pixels(png):
    """Pixels (height, width, 3) of a PNG; fails on anything else."""
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    image = imread(io.BytesIO(png))[..., :3]
    assert min(image.shape[:2]) > 60
    assert image.std() > 0.01
    return image


def share(image, color):
    """Share of the pixels that have about this colour."""
    wanted = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    return (np.abs(image - wanted).max(-1) < 0.08).mean()


def shows(image, color):
    return share(image, color) > 0


def test_chart_has_a_line_for_each_model(make_result):
    results = [make_result(name, psnr=(50 + n, 40 + n, 45 - n, 30)) for n, name in enumerate("ab")]
    image = pixels(figures.psnr_chart(results))
    for contender in figures.CONTENDERS:
        assert shows(image, contender.color), contender.key


def test_chart_of_one_and_of_many(make_result):
    one = pixels(figures.psnr_chart([make_result()]))
    many = pixels(figures.psnr_chart([make_result(HOSTILE)] * 130))
    assert many.shape[1] > one.shape[1]


def test_sheet_shows_pictures_and_differences(make_result):
    result = make_result()
    once = pixels(figures.picture_sheet(result, ["sphere", "mesh"]))
    # a model that is the data has no difference: black
    result.pictures[0][1:] = result.pictures[0][:1]
    without = pixels(figures.picture_sheet(result, ["sphere", "mesh"]))
    assert (without == 0).all(-1).sum() > (once == 0).all(-1).sum() + 100
    assert pixels(figures.picture_sheet(make_result(n_scenes=1), ["sphere"])).shape < once.shape


@pytest.mark.parametrize("name", ["gold", HOSTILE])
def test_curves_and_slices(make_result, name):
    result = make_result(name)
    curves = pixels(figures.factor_curves(result.name, result.factors))
    assert all(shows(curves, color) for color in figures.CHANNEL_COLORS)
    slices = pixels(figures.polar_slices(result))
    assert share(slices, figures.GRAZING_COLOR) > 0.01  # more than its place in the legend
    assert all(shows(slices, contender.color) for contender in figures.CONTENDERS)


def test_slices_of_a_black_model(make_result):
    result = make_result()
    result.slices[2:] = 0
    pixels(figures.polar_slices(result))


def test_the_same_bytes_every_time(make_result):
    assert figures.polar_slices(make_result()) == figures.polar_slices(make_result())
