"""What becomes of a model's tables on their way into a shader."""

import numpy as np
import pytest

from fitter.shading.base_lobes import fit_base_lobes
from tests.models import ANISOTROPIC_MODELS, MODELS


@pytest.fixture
def tables_of(addon):
    return lambda model: addon("shader_source")._base_tables(fit_base_lobes(model, draft=True))


def test_isotropic_weights_are_written_as_they_are(tables_of):
    base = fit_base_lobes(MODELS["plastic"], draft=True)
    written = tables_of(MODELS["plastic"])
    assert np.array_equal(np.ravel(base.weights.swapaxes(3, 4)), written.weights)
    assert np.array_equal(np.ravel(base.picking), written.picking)


def test_anisotropic_weights_have_six_digits_of_a_lobes_largest(tables_of):
    model = ANISOTROPIC_MODELS["brushed"]
    base = fit_base_lobes(model, draft=True)
    written = np.reshape(tables_of(model).weights, base.weights.swapaxes(3, 4).shape)
    written = written.swapaxes(3, 4)
    error = np.abs(written - base.weights).max((3, 4))
    assert error.max() > 0
    assert (error <= 5.1e-6 * np.abs(base.weights).max((3, 4))).all()


def test_a_lobe_of_nothing_stays_nothing(addon):
    table = np.zeros((2, 3, 3, 4))
    table[:, :, 1] = -1.23456e-8
    rounded = addon("shader_source")._rounded(table, 5)
    assert not rounded[:, :, 0].any()
    assert rounded[0, 0, 1, 0] == pytest.approx(-1.2346e-8, rel=1e-9)
