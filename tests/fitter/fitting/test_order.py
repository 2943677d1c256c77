# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.fitting import order


def nearest_nondecreasing(values, weights):
    """Min-max formula of isotonic regression: max over i <= k of min over j >= k of the mean."""
    n = len(values)

    def mean(i, j):
        return np.average(values[i : j + 1], weights=weights[i : j + 1])

    return [max(min(mean(i, j) for j in range(k, n)) for i in range(k + 1)) for k in range(n)]


@pytest.mark.parametrize("seed", range(5))
def test_nearest_nondecreasing_curve(seed):
    rng = np.random.default_rng(seed)
    values, weights = rng.random(20), rng.uniform(0.1, 3, 20)
    got = order.nondecreasing(values, weights)
    np.testing.assert_allclose(got, nearest_nondecreasing(values, weights), rtol=1e-12)
    unweighted = nearest_nondecreasing(values, np.ones(20))
    np.testing.assert_allclose(order.nondecreasing(values), unweighted, rtol=1e-12)


def test_curves_in_order_stay():
    values = np.array([0.0, 0.0, 1.0, 2.0, 2.0, 7.0])
    np.testing.assert_array_equal(order.nondecreasing(values), values)
    np.testing.assert_array_equal(order.single_peaked(values[::-1]), values[::-1])
    peak = np.array([1.0, 3.0, 9.0, 4.0, 0.0])
    np.testing.assert_array_equal(order.single_peaked(peak), peak)


def test_one_peak_remains_at_the_maximum():
    values = np.random.default_rng(0).random(50)
    got = order.single_peaked(values)
    peak = values.argmax()
    assert got.shape == values.shape
    assert got[peak] == values[peak]
    assert (np.diff(got[: peak + 1]) >= 0).all()
    assert (np.diff(got[peak:]) <= 0).all()


def test_factors_are_put_in_order(random_model):
    model = random_model(0)
    zeroed = replace(
        model,
        fresnel=np.where(model.fresnel < 0.6, 0, model.fresnel),
        masking=np.where(model.masking < 0.2, 0, model.masking),
    )
    fresnel = order.order_fresnel(zeroed).fresnel
    masking = order.order_masking(zeroed).masking
    ndf = order.order_ndf(zeroed).ndf
    assert (np.diff(fresnel) >= 0).all()
    assert (np.diff(masking) <= 0).all()
    for row, before in zip(ndf, model.ndf, strict=True):
        assert row.argmax() == before.argmax()
        assert (np.diff(row[row.argmax() :]) <= 0).all()
        assert (np.diff(row[: row.argmax() + 1]) >= 0).all()
    # joint steps move logarithms
    assert min(fresnel.min(), masking[:, :-1].min(), ndf.min()) > 0
    # else f would have no bound at the horizon
    np.testing.assert_array_equal(masking[:, -1], 0)
    # each touches one factor only
    for ordered, name in ((order.order_fresnel, "fresnel"), (order.order_masking, "masking")):
        after = ordered(zeroed)
        for other in {"diffuse", "scale", "ndf", "masking", "fresnel"} - {name}:
            assert getattr(after, other) is getattr(zeroed, other)
