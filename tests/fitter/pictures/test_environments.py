# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from fitter.pictures.environments import synthetic_maps
from fitter.pictures.sphere import ENVIRONMENT_SHAPE


def test_maps_are_positive_with_mean_1_and_high_contrast():
    maps = synthetic_maps(4)
    assert maps.shape == (4, *ENVIRONMENT_SHAPE)
    assert (maps > 0).all()
    np.testing.assert_allclose(maps.mean((1, 2)), 1, rtol=1e-12)
    assert (maps.max((1, 2)) > 3).all()
    assert maps.max() > 20


def test_maps_are_the_same_every_time():
    first = synthetic_maps(2)
    synthetic_maps.cache_clear()
    np.testing.assert_array_equal(synthetic_maps(2), first)
    np.testing.assert_array_equal(synthetic_maps(4)[:2], first)
    assert not np.allclose(first[0], first[1])
    assert synthetic_maps(0).shape == (0, *ENVIRONMENT_SHAPE)
