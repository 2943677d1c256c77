# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots as pixels and as icons."""

import numpy as np
import pytest

from fitter.metrics import tabulate
from fitter.parameter_file import FittedMaterial
from fitter.slices import measured_slices
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture
def plot(addon):
    return addon("plot")


def near(pixels, color):
    return np.abs(pixels[..., :3] - color).max(-1) < 0.1


def test_a_straight_curve_runs_through_the_middle(plot):
    picture = plot.Plot()
    picture.curve(np.array([0.0, 1.0]), np.array([0.0, 1.0]), (1.0, 0.0, 0.0))
    rows, columns = np.nonzero(near(picture.pixels(), (1, 0, 0)))
    assert len(rows) > 200
    assert np.abs(rows - columns).max() <= 2


def test_gaps_in_the_data_are_gaps_in_the_curve(plot):
    picture = plot.Plot()
    y = np.array([0.5, 0.5, np.nan, np.nan, 0.5, 0.5])
    picture.curve(np.linspace(0, 1, 6), y, (1.0, 0.0, 0.0))
    drawn = near(picture.pixels(), (1, 0, 0)).any(0)
    assert drawn[10:50].all()
    assert not drawn[110:140].any()


@pytest.mark.parametrize("kind", ["NDF", "FRESNEL", "MASKING"])
def test_every_curve_of_a_factor_is_seen(kind, plot):
    pixels = plot.PLOTS[kind](MODELS["paint"], None)
    assert pixels.shape == (256, 256, 4)
    colors = plot.CHANNELS if kind == "FRESNEL" else plot.LOBES
    # curves may lie over each other; the last is on top
    assert near(pixels, colors[-1]).sum() > 200
    assert ((pixels >= 0) & (pixels <= 1)).all()


def test_slices_lie_over_the_measurement(plot, make_measurement):
    model = MODELS["matte"]
    measured = measured_slices(make_measurement(tabulate(model)))
    alone, both = plot.plot_slices(model), plot.plot_slices(model, measured)
    other = plot.plot_slices(model, measured / 5)
    grey = [near(p, plot.MEASURED).sum() for p in (alone, both, other)]
    # visible on both sides of the curves; without them wholly
    assert grey[0] < 20 < grey[1] < 0.8 * grey[2]


def test_slices_travel_as_text(addon, make_measurement):
    text = addon("slices_text")
    slices = measured_slices(make_measurement(tabulate(MODELS["paint"])))
    np.testing.assert_allclose(text.decode(text.encode(slices)), slices, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("damage", ["", "x", "é", "AAAA"])
def test_damaged_slices_are_none(damage, addon):
    assert addon("slices_text").decode(damage) is None


def test_icons_are_drawn_anew_only_for_another_model(addon, fitted, monkeypatch):
    module = addon("plot_icons")
    drawn = []
    white = np.ones((256, 256, 4), np.float32)
    monkeypatch.setitem(module.PLOTS, "NDF", lambda *_: drawn.append(1) or white)
    first, second = addon("material").build(fitted), addon("material").build(fitted)
    second.nfm.slices = "other"
    for item in (first, first, second, first):
        module.icons.icon_of(item, "NDF")
    assert len(drawn) == 3


def test_anisotropic_materials_are_plotted_as_their_mean(addon):
    (model, *_) = ANISOTROPIC_MODELS.values()
    item = addon("material").build(FittedMaterial("brushed", model), "REFERENCE")
    for kind in addon("plot").PLOTS:
        addon("plot_icons").icons.icon_of(item, kind)
    assert item.nfm.numbers == 2010
