# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import fields

import numpy as np
import pytest

from fitter import curves
from fitter.curves import CURVES, FRESNEL_CURVES, MASKING_CURVES, NDF_CURVES, Curves
from fitter.geometry import index_from_theta_h, theta_d_centres, theta_h_centres
from fitter.splines import masking_nodes
from tests.models import MODELS


def test_positions_are_those_of_the_nodes():
    for name in NDF_CURVES:
        expected = index_from_theta_h(theta_h_centres()) / 90
        np.testing.assert_allclose(curves.positions(name), expected, rtol=1e-12)
    for name in MASKING_CURVES:
        np.testing.assert_allclose(curves.positions(name), masking_nodes() / (np.pi / 2))
    for name in FRESNEL_CURVES:
        np.testing.assert_allclose(curves.positions(name), theta_d_centres() / (np.pi / 2))


def test_drawn_heights():
    model = MODELS["metal"]
    drawn = curves.drawn(model)
    decades = np.log10(model.ndf[1, 30])
    assert drawn.ndf[1, 30] == pytest.approx(1 + decades / 6)
    assert drawn.ndf.max(1) == pytest.approx(1)
    assert drawn.ndf.min() >= 0
    np.testing.assert_array_equal(drawn.masking, model.masking)
    np.testing.assert_array_equal(drawn.fresnel[1:], model.fresnel)
    np.testing.assert_allclose(drawn.fresnel[0], model.fresnel.mean(0))


def test_drawn_heights_of_nothing_are_zero():
    model = MODELS["metal"]
    nothing = type(model)(*(np.zeros_like(getattr(model, f.name)) for f in fields(model)))
    for heights in curves.drawn(nothing).heights().values():
        np.testing.assert_array_equal(heights, 0)


def test_curves_by_name_and_back():
    drawn = curves.drawn(MODELS["paint"])
    heights = drawn.heights()
    assert tuple(heights) == CURVES
    np.testing.assert_array_equal(heights["Lobe 2 G"], drawn.masking[1])
    np.testing.assert_array_equal(heights["F Green"], drawn.fresnel[2])
    assert Curves.from_heights(heights).equals(drawn)
    heights["F Blue"] = heights["F Blue"] * 1.001
    assert not Curves.from_heights(heights).equals(drawn)


# ---- handles ----


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("material", MODELS)
def test_few_handles_follow_the_curve(material, name):
    places, heights = curves.positions(name), curves.drawn(MODELS[material]).heights()[name]
    handles = curves.place_handles(places, heights)
    assert 2 <= len(handles) <= curves.MOST_HANDLES
    assert (np.diff(handles[:, 0]) > 0).all()
    assert handles[0, 0] == 0
    assert handles[-1, 0] == 1
    error = np.abs(np.interp(places, *handles.T) - heights).max()
    assert error <= curves.TOLERANCE or (len(handles) == curves.MOST_HANDLES and error < 0.02)


def test_a_straight_line_needs_its_ends_alone():
    places = curves.positions("F")
    assert len(curves.place_handles(places, 0.2 + 0.5 * places)) == 2


def test_handles_are_placed_for_the_interpolation_they_get():
    """One that ignores its handles is never good, and gets all of them."""
    places = curves.positions("F")
    handles = curves.place_handles(places, places**2, lambda _handles, at: np.zeros(len(at)))
    assert len(handles) == curves.MOST_HANDLES
    assert len(curves.place_handles(places, places**2)) < curves.MOST_HANDLES


# ---- bending ----


def test_logarithmic_bend_is_a_ratio():
    factor = np.array([[1.0, 0.1, 0.01, 1e-9]])
    before = np.array([[1.0, 0.8, 0.6, 0.0]])
    after = before + np.array([[0, 0, 1 / 6, 2 / 6]])
    bent = curves.bend_logarithmic(factor, before, after)
    # what is below the axis is raised from its lower end
    np.testing.assert_allclose(bent, [[1.0, 0.1, 0.1, 1e-4]], rtol=1e-12)
    np.testing.assert_array_equal(bent[:, :2], factor[:, :2])


def test_linear_bend_is_a_ratio():
    factor = np.array([[1.0, 0.5, 0.2, 0.0, 0.3]])
    before = np.array([[1.0, 0.4, 0.2, 0.0, 0.3]])
    after = np.array([[1.0, 0.2, 0.1, 0.5, 0.0]])
    bent = curves.bend_linear(factor, before, after)
    np.testing.assert_allclose(bent, [[1.0, 0.25, 0.1, 0.5, 0.0]], rtol=1e-12)


@pytest.mark.parametrize("bend", [curves.bend_linear, curves.bend_logarithmic])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -5.0, 1e30])
def test_any_height_gives_a_number(bend, bad):
    factor = np.array([[0.0, 1e-3, 1.0, 0.0]])
    heights = np.array([[0.0, 0.5, 1.0, 0.2]])
    wild = heights.copy()
    wild[:, 1:3] = bad
    for before, after in ((heights, wild), (wild, heights)):
        bent = bend(factor, before, after)
        assert np.isfinite(bent).all()
        assert (bent >= 0).all()
