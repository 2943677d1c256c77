# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import fields

import numpy as np
import pytest

from fitter.editing import curves
from fitter.editing.curves import (
    AROUND_CURVES,
    CURVES,
    CURVES_OF,
    FRESNEL_CURVES,
    MASKING_CURVES,
    NDF_CURVES,
)
from fitter.geometry import index_from_theta_h, theta_d_centres, theta_h_centres
from fitter.models.splines import masking_nodes
from tests.models import MODELS

ISOTROPIC = CURVES_OF["isotropic"]


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
    assert tuple(drawn) == ISOTROPIC
    decades = np.log10(model.ndf[1, 30])
    assert drawn["Lobe 2 D"][30] == pytest.approx(1 + decades / 6)
    for lobe in range(3):
        assert drawn[NDF_CURVES[lobe]].max() == pytest.approx(1)
        assert drawn[NDF_CURVES[lobe]].min() >= 0
        np.testing.assert_array_equal(drawn[MASKING_CURVES[lobe]], model.masking[lobe])
    np.testing.assert_array_equal(drawn["F Green"], model.fresnel[1])
    np.testing.assert_allclose(drawn["F"], model.fresnel.mean(0))


def test_drawn_heights_of_nothing_are_zero():
    model = MODELS["metal"]
    nothing = type(model)(*(np.zeros_like(getattr(model, f.name)) for f in fields(model)))
    for heights in curves.drawn(nothing).values():
        np.testing.assert_array_equal(heights, 0)


def test_names():
    assert set(CURVES) == set(CURVES_OF["anisotropic"]) == {*ISOTROPIC, *AROUND_CURVES}
    assert curves.curves_of_lobe(1, "isotropic") == ("Lobe 2 D", "Lobe 2 G")
    assert curves.curves_of_lobe(2, "anisotropic") == (
        *("Lobe 3 D", "Lobe 3 D around", "Lobe 3 G", "Lobe 3 G around"),
    )


# ---- handles ----


@pytest.mark.parametrize("name", ISOTROPIC)
@pytest.mark.parametrize("material", MODELS)
def test_few_handles_follow_the_curve(material, name):
    places, heights = curves.positions(name), curves.drawn(MODELS[material])[name]
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


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -5.0, 1e30])
def test_any_height_gives_a_number(bad):
    model = MODELS["metal"]
    drawn = curves.drawn(model)
    wild = {name: np.where(np.arange(90) % 7 == 3, bad, row) for name, row in drawn.items()}
    for before, after in ((drawn, wild), (wild, drawn)):
        bent = curves.bend(model, before, after)
        for factor in (bent.ndf, bent.masking, bent.fresnel):
            assert np.isfinite(factor).all()
            assert (factor >= 0).all()
