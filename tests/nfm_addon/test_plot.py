# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots as pixels and as icons."""

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from fitter.grading.metrics import tabulate
from fitter.grading.slices import measured_slices
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
    size = len(drawn)
    assert drawn[size // 20 : size // 5].all()
    assert not drawn[int(0.43 * size) : int(0.55 * size)].any()


@pytest.mark.parametrize("kind", ["NDF", "FRESNEL", "MASKING"])
def test_every_curve_of_a_factor_is_seen(kind, plot):
    pixels = plot.PLOTS[kind](MODELS["paint"], None, None)
    assert pixels.shape == (plot.SIZE, plot.SIZE, 4)
    colors = plot.CHANNELS if kind == "FRESNEL" else plot.LOBES
    # curves may lie over each other; the last is on top
    assert near(pixels, colors[-1]).sum() > 200
    assert ((pixels >= 0) & (pixels <= 1)).all()


def test_slices_lie_over_the_measurement(plot, make_measurement):
    model = MODELS["matte"]
    measured = measured_slices(make_measurement(tabulate(model)))
    alone, both, other = (
        plot.plot_slices(model, None, data) for data in (None, measured, measured / 5)
    )
    grey = [near(p, plot.MEASURED).sum() for p in (alone, both, other)]
    # visible on both sides of the curves; without them wholly
    assert grey[0] < 20 < grey[1] < 0.8 * grey[2]


@pytest.mark.parametrize("kind", ["NDF", "FRESNEL", "MASKING", "SLICES"])
def test_the_fit_is_a_thin_line_behind_what_was_edited(kind, plot):
    edited, fitted = MODELS["paint"], MODELS["metal"]
    alone, both = (plot.PLOTS[kind](edited, behind, None) for behind in (None, fitted))
    changed = (alone != both).any(-1)
    lit = [(picture[..., :3].max(-1) > 0.4).sum() for picture in (alone, both)]
    assert changed.sum() > 300
    assert lit[0] < lit[1]
    if kind != "SLICES":  # whose scale is that of the fit
        # what is edited lies on top
        colors = plot.CHANNELS if kind == "FRESNEL" else plot.LOBES
        covered = np.abs(alone[..., :3] - colors[-1]).max(-1) < 1e-3
        assert covered.sum() > 100
        assert not changed[covered].any()
        alone = plot.PLOTS[kind](fitted, None, None)
        assert changed.sum() < 0.7 * (alone[..., :3].max(-1) > 0.4).sum()


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
    monkeypatch.setitem(module.PLOTS, "NDF", lambda *models: drawn.append(models) or white)
    monkeypatch.setattr(module.icons, "_drawn", {})
    first, second = addon("material").build(fitted), addon("material").build(fitted)
    second.nfm.slices = "other"
    for item in (first, first, second, first):
        module.icons.icon_of(item, "NDF")
    assert len(drawn) == 3
    assert all(behind is None for _, behind, _ in drawn)


def test_icons_follow_edits(addon, fitted, monkeypatch):
    module = addon("plot_icons")
    drawn = []
    white = np.ones((256, 256, 4), np.float32)
    monkeypatch.setitem(module.PLOTS, "NDF", lambda *models: drawn.append(models) or white)
    monkeypatch.setattr(module.icons, "_drawn", {})
    item = addon("material").build(fitted)
    item.nfm.edit.lobe_1.width = 2.0
    addon("live").flush()
    module.icons.icon_of(item, "NDF")
    item.nfm.edit.lobe_2.gain = 0.5  # makes no new shader
    module.icons.icon_of(item, "NDF")
    (first, behind, _), (second, _, _) = drawn
    np.testing.assert_array_equal(behind.ndf, fitted.model.ndf)
    assert not np.array_equal(first.ndf[0], behind.ndf[0])
    np.testing.assert_allclose(second.scale[1], 0.5 * fitted.model.scale[1])
    item.nfm.edit.show_original = True
    addon("live").flush()
    module.icons.icon_of(item, "NDF")
    assert drawn[-1][1] is None


def test_swatches_have_their_color(addon):
    icons = addon("plot_icons").icons
    color = (0.25, 0.5, 0.75)
    icons.swatch(color)
    preview = icons._previews[repr(color)]
    pixels = np.array(preview.icon_pixels_float).reshape(16, 16, 4)
    np.testing.assert_allclose(pixels[8, 8, :3], color, atol=0.01)
    assert pixels[0, 0, 3] == 0


def test_anisotropic_materials_are_plotted_as_their_mean(addon):
    (model, *_) = ANISOTROPIC_MODELS.values()
    item = addon("material").build(FittedMaterial("brushed", model), "REFERENCE")
    for kind in addon("plot").PLOTS:
        addon("plot_icons").icons.icon_of(item, kind)
    assert item.nfm.numbers == 2010
