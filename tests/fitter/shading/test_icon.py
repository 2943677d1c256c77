# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.grading.metrics import tabulate
from fitter.shading import icon
from fitter.shading.base_error import studio_psnr
from tests.models import MODELS


@pytest.fixture(scope="module")
def plastic():
    return icon.material_icon(MODELS["plastic"], size=64)


def test_a_disc_of_display_values(plastic):
    assert plastic.shape == (64, 64, 4)
    assert plastic.dtype == np.float32
    assert ((plastic >= 0) & (plastic <= 1)).all()
    assert (plastic[32, 32, 3], plastic[0, 0, 3]) == (1, 0)


def test_light_comes_from_the_upper_left_and_the_material_has_its_colour(plastic):
    shaded = plastic[..., :3] * (plastic[..., 3:] == 1)
    row, column = np.unravel_index(shaded.sum(-1).argmax(), (64, 64))
    assert row > 32 > column
    assert shaded[..., 2].mean() > 1.2 * shaded[..., 0].mean()


def test_no_seams(plastic):
    """Neighbouring pixels away from the edge and the highlight differ little."""
    lower = plastic[12:28, 20:44, 1]
    assert np.abs(np.diff(lower, axis=0)).max() < 0.03
    assert np.abs(np.diff(lower, axis=1)).max() < 0.03


def test_studio_psnr_of_a_tabulated_model_is_high_and_falls_with_an_error(make_measurement):
    model = MODELS["matte"]
    table = tabulate(model)
    exact = studio_psnr(model, make_measurement(table))
    off = studio_psnr(model, make_measurement(table * [1.05, 1, 1]))
    assert exact > 50 > off > 30
