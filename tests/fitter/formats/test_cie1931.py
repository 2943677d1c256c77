# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.formats.cie1931 import TABLE, WAVELENGTHS, srgb_from_reflectance


def test_equal_energy_is_neutral():
    """The observer is defined so that its three functions have the same integral."""
    sums = TABLE[:, :3].sum(0)
    np.testing.assert_allclose(sums, sums.mean(), rtol=1e-5)


def test_observer_sees_best_at_555_nm():
    assert WAVELENGTHS[TABLE[:, 1].argmax()] == 555
    assert TABLE[:, 1].max() == 1


def test_white_point_of_d65():
    """CIE 15: x = 0.31272, y = 0.32903 for the 2 degree observer."""
    xyz = TABLE[:, :3].T @ TABLE[:, 3]
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [0.31272, 0.32903], atol=1e-5)


@pytest.mark.parametrize("step", [1, 4, 10, 55])
def test_white_reflector_is_white(step):
    matrix = srgb_from_reflectance(np.arange(360, 1001, step))
    np.testing.assert_allclose(matrix.sum(1), 1, rtol=1e-12)


def test_wavelength_the_observer_does_not_see():
    matrix = srgb_from_reflectance(np.array([100.0, 200, 380, 780, 900, 1000]))
    assert (matrix[:, [0, 1, 4, 5]] == 0).all()


def test_hues():
    """Narrow bands of reflectance: blue, green and red, and out of the gamut."""
    wavelengths = np.arange(380.0, 781, 4)
    for centre, channel in ((450, 2), (530, 1), (620, 0)):
        band = np.exp(-(((wavelengths - centre) / 15) ** 2))
        rgb = srgb_from_reflectance(wavelengths) @ band
        assert rgb.argmax() == channel
        assert rgb.min() < 0


def test_nodes_do_not_matter_to_a_smooth_reflectance():
    def smooth(wavelengths):
        return 0.5 + 0.3 * np.sin(wavelengths / 60)

    colours = [
        srgb_from_reflectance(w) @ smooth(w)
        for w in (np.arange(360.0, 831, 1), np.arange(377.0, 801, 5.5), WAVELENGTHS.astype(float))
    ]
    np.testing.assert_allclose(colours[1], colours[0], atol=1e-3)
    np.testing.assert_allclose(colours[2], colours[0], atol=1e-3)


def test_many_wavelengths_take_little_memory():
    """A hostile file may claim a million of them."""
    matrix = srgb_from_reflectance(np.linspace(360, 830, 1_000_000))
    np.testing.assert_allclose(matrix.sum(1), 1, rtol=1e-9)


def test_against_mitsuba():
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    wavelengths = np.linspace(360, 830, 95)
    for values in (np.linspace(0, 1, 95), 0.5 + 0.4 * np.cos(wavelengths / 30)):
        theirs = mitsuba.spectrum_list_to_srgb(list(wavelengths), list(values), False, True)
        white = mitsuba.spectrum_list_to_srgb(list(wavelengths), [1.0] * 95, False, True)
        ours = srgb_from_reflectance(wavelengths) @ values
        np.testing.assert_allclose(ours, np.array(theirs) / np.array(white), rtol=3e-3)
