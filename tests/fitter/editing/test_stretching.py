# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.editing.stretching import stretched
from tests.models import ANISOTROPIC_MODELS, MODELS, ggx_at


def light(ndf):
    """Integral of D cos theta_h over the polar grid."""
    cosine = polar_grid.directions()[:, 2]
    return ndf.ravel() @ (cosine * polar_grid.solid_angles())


@pytest.mark.parametrize("model", ANISOTROPIC_MODELS.values(), ids=ANISOTROPIC_MODELS)
@pytest.mark.parametrize("widths", [(2.0, 1.0), (0.5, 3.0), (1.3, 1.3)])
def test_the_lobe_keeps_its_light(model, widths):
    for lobe in range(3):
        found = stretched(model, lobe, *widths, direction=0.4)
        assert light(found) == pytest.approx(light(model.ndf[lobe]))
        np.testing.assert_allclose(found[0], found[0, 0], rtol=1e-12)


@pytest.mark.parametrize("direction", [0, 90])
def test_widths_of_ggx_are_its_roughnesses(direction):
    """As far as a grid of 15 degrees can show: a wide lobe is known well enough."""
    nodes = polar_grid.directions()
    table = ggx_at(nodes, 0.5, 0.7).reshape(polar_grid.GRID)
    model = replace(ANISOTROPIC_MODELS["satin"], ndf=np.stack([table] * 3))
    found = stretched(model, 0, 1.5, 1.0, np.radians(direction))
    expected = ggx_at(nodes, *((0.75, 0.7), (0.5, 1.05))[direction // 90]).reshape(polar_grid.GRID)
    expected *= light(found) / light(expected)
    np.testing.assert_allclose(found, expected, rtol=0.1, atol=0.02 * expected.max())


def test_an_isotropic_lobe_takes_one_width():
    model = MODELS["metal"]
    np.testing.assert_array_equal(stretched(model, 1, 2.0, 2.0), stretched(model, 1, 2.0, 7.0, 1.0))


def test_nothing_stays_nothing():
    for model in (MODELS["metal"], ANISOTROPIC_MODELS["brushed"]):
        dark = replace(model, ndf=np.zeros_like(model.ndf))
        assert not stretched(dark, 0, 2.0, 3.0).any()
