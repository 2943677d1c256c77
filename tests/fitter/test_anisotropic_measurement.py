# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import polar_grid
from tests.anisotropic_measurements import measurement_of, random_pairs


@pytest.fixture(scope="module")
def measurement():
    return measurement_of(np.random.default_rng(0).uniform(0, 2, (6, 48, 6, 48, 3)))


def test_nodes_are_looked_up(measurement):
    w = polar_grid.directions()
    i, o = np.random.default_rng(1).integers(48, 288, (2, 500))
    expected = measurement.f_r.reshape(288, 288, 3)[i, o]
    np.testing.assert_allclose(measurement.lookup(w[i], w[o]), expected, rtol=1e-9)


def test_linear_in_each_angle(measurement):
    """Half-way between two nodes in one of the four angles: the mean of both."""
    table = measurement.f_r
    at = {"theta_i": 2, "phi_i": 47, "theta_o": 3, "phi_o": 5}
    for axis, name in enumerate(at):
        low, high = list(at.values()), list(at.values())
        high[axis] = (high[axis] + 1) % (6 if "theta" in name else 48)
        angles = {k: np.radians(v * (15 if "theta" in k else 7.5)) for k, v in at.items()}
        angles[name] += np.radians(7.5 if "theta" in name else 3.75)
        wi, wo = (
            polar_grid.unit_vectors(np.array([angles[t]]), np.array([angles[p]]))
            for t, p in (("theta_i", "phi_i"), ("theta_o", "phi_o"))
        )
        expected = (table[tuple(low)] + table[tuple(high)]) / 2
        np.testing.assert_allclose(measurement.lookup(wi, wo)[0], expected, rtol=1e-9)


def test_constant_beyond_75_degrees(measurement):
    phi = np.full(3, 0.7)
    wi = polar_grid.unit_vectors(np.radians([75.0, 80.0, 89.9]), phi)
    wo = polar_grid.unit_vectors(np.full(3, 0.5), phi)
    values = measurement.lookup(wi, wo)
    np.testing.assert_allclose(values, np.repeat(values[:1], 3, axis=0), rtol=1e-9)


def test_between_the_extremes(measurement):
    values = measurement.lookup(*random_pairs(np.random.default_rng(2), 5000))
    assert values.min() >= 0
    assert values.max() <= 2
