# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.taps import Taps

SIZE = 7


@pytest.fixture
def taps():
    rng = np.random.default_rng(1)
    return Taps(SIZE, rng.integers(0, SIZE, (3, 50)), rng.normal(size=(3, 50)))


def test_values_are_weighted_sums(taps):
    tables = np.random.default_rng(2).normal(size=(4, SIZE))
    expected = sum(tables[:, i] * w for i, w in zip(taps.index, taps.weight, strict=True))
    before = tables.copy()
    np.testing.assert_allclose(taps.of(tables), expected, rtol=1e-14)
    np.testing.assert_array_equal(tables, before)


def test_the_matrix_is_the_same_map_and_gathering_its_transpose(taps):
    table, values = np.random.default_rng(3).normal(size=(2, 50))
    table = table[:SIZE]
    np.testing.assert_allclose(taps.matrix() @ table, taps.of(table[None])[0], rtol=1e-12)
    np.testing.assert_allclose(taps.matrix().T @ values, taps.gathered(values), atol=1e-12)


def test_linear_between_numbers_and_constant_beyond():
    table = np.array([[3.0, 5.0, 4.0]])
    positions = np.array([-2, 0, 0.25, 1, 1.5, 2, 9])
    np.testing.assert_allclose(
        Taps.linear(positions, 3).of(table)[0], [3, 3, 3.5, 5, 4.5, 4, 4], rtol=1e-14
    )
