# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.editing import curves, edits, polar_curves
from fitter.editing.curves import AROUND_CURVES, CURVES_OF
from fitter.editing.edits import Edits
from tests.models import ANISOTROPIC_MODELS, random_anisotropic


def bent(model, name, change):
    """The model with one curve's heights changed."""
    before = polar_curves.drawn(model)
    return edits.apply(model, Edits(before, {name: change(before[name].copy())}))


@pytest.mark.parametrize("model", ANISOTROPIC_MODELS.values(), ids=ANISOTROPIC_MODELS)
def test_drawn_heights(model):
    drawn = polar_curves.drawn(model)
    assert set(drawn) == set(CURVES_OF["anisotropic"])
    for heights in drawn.values():
        assert heights.shape == (90,)
        assert heights.min() >= 0
        assert heights.max() <= 1 + 1e-12
    # over theta, the mean over azimuths
    rows = model.ndf[0].mean(-1)
    theta = curves.positions("Lobe 1 D") ** 2 * 90
    expected = np.interp(theta, np.arange(0, 90, 15), rows)
    np.testing.assert_allclose(
        drawn["Lobe 1 D"], 1 + np.log10(expected / expected.max()) / 6, atol=1e-9
    )
    assert drawn["Lobe 1 G"][-1] == pytest.approx(0, abs=1e-9)


def test_the_curve_around_shows_where_the_light_is():
    """Across the brush marks, at 90 and 270 degrees."""
    around = polar_curves.drawn(ANISOTROPIC_MODELS["brushed"])["Lobe 1 D around"]
    places = 360 * curves.positions("Lobe 1 D around")
    assert np.abs(places[around > 0.98] % 180 - 90).max() < 15
    assert np.abs((places[around < around.min() + 0.02] + 90) % 180 - 90).max() < 15
    # periodic: both ends are one azimuth
    assert around[0] == pytest.approx(around[-1], abs=1e-9)


@pytest.mark.parametrize("name", AROUND_CURVES)
def test_a_raised_curve_around_raises_all_azimuths(name):
    model = random_anisotropic(3)
    lobe, factor = int(name[5]) - 1, "ndf" if "D" in name else "masking"
    # the heights may go above the widget
    changed = bent(model, name, lambda heights: heights * 0.5)
    before, after = getattr(model, factor), getattr(changed, factor)
    np.testing.assert_array_equal(np.delete(after, lobe, 0), np.delete(before, lobe, 0))
    if factor == "masking":
        np.testing.assert_allclose(after[lobe], before[lobe] / 2, rtol=1e-9)
    assert (after[lobe] < before[lobe]).all()


def test_a_curve_around_modulates_azimuths():
    model = ANISOTROPIC_MODELS["satin"]

    def dent(heights):
        heights[20:25] -= 0.1  # 80 to 100 degrees
        return heights

    ratio = bent(model, "Lobe 2 D around", dent).ndf[1] / model.ndf[1]
    phi = np.arange(48) * 7.5
    inside = np.abs(phi - 90) < 8
    np.testing.assert_allclose(ratio[1:, inside], 10**-0.3, rtol=0.2)
    np.testing.assert_array_equal(ratio[1:, np.abs(phi - 90) > 20], 1)
    # the pole has no azimuth
    assert np.ptp(ratio[0]) == pytest.approx(0, abs=1e-12)
    assert 0.9 < ratio[0, 0] < 1


def test_the_seam_is_no_edge():
    """A dent at 0 degrees, half of it at each end of the widget, is a dent at 90 turned."""
    model = random_anisotropic(1)
    flat = replace(model, ndf=np.ones_like(model.ndf))
    before = polar_curves.drawn(flat)
    dent = np.exp(-(((np.arange(90) - 44.5) / 6) ** 2))
    middle, seam = (
        edits.apply(flat, Edits(before, {"Lobe 1 D around": before["Lobe 1 D around"] - shape}))
        for shape in (dent, np.roll(dent, 45))
    )
    np.testing.assert_allclose(np.roll(middle.ndf, 24, axis=-1), seam.ndf, rtol=1e-9)


def test_a_curve_over_theta_acts_on_all_azimuths():
    model = ANISOTROPIC_MODELS["brushed"]

    def lower_tail(heights):
        heights[70:] -= 0.1  # beyond 54 degrees
        return heights

    ratio = bent(model, "Lobe 1 D", lower_tail).ndf[0] / model.ndf[0]
    np.testing.assert_allclose(ratio, ratio[:, :1].repeat(48, 1), rtol=1e-12)
    np.testing.assert_array_equal(ratio[:3], 1)
    np.testing.assert_allclose(ratio[-1], 10**-0.6, rtol=1e-9)


@pytest.mark.parametrize("place", [5, 30, 60, 85])
@pytest.mark.parametrize("name", ["Lobe 1 D", "Lobe 1 G", "Lobe 1 D around", "Lobe 1 G around"])
def test_a_handle_acts_wherever_it_is(name, place):
    """Nodes are far apart: a narrow bump between two of them must not be lost."""
    model = ANISOTROPIC_MODELS["satin"]

    def bump(heights):
        heights[place] += 0.2
        return heights

    changed = bent(model, name, bump)
    factor = "ndf" if "D" in name else "masking"
    assert (getattr(changed, factor)[0] > getattr(model, factor)[0]).any()


def test_flat_zero_is_black_where_the_axis_is_linear():
    for name in ("Lobe 1 G", "Lobe 1 G around"):
        changed = bent(ANISOTROPIC_MODELS["pile"], name, np.zeros_like)
        assert not changed.masking[0].any()
