# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.fitting import fit, limits, peak
from fitter.grading import metrics


@pytest.fixture(scope="module")
def glaring(planted):
    """The planted model with an F that rises ten times in its last bins."""
    fresnel = planted.fresnel * np.where(np.arange(90) >= 86, 10, 1)
    return replace(planted, fresnel=fresnel).normalized()


def test_what_is_too_bright_at_the_horizon_is_lowered(glaring, planted_measurement):
    largest = planted_measurement.f_r.max()
    before, after = (
        metrics.tabulate(model) for model in (glaring, peak.within_peak(glaring, largest))
    )
    assert limits.limits(before, planted_measurement).peak_ratio > 5
    ratio = limits.limits(after, planted_measurement).peak_ratio
    assert ratio == pytest.approx(peak.MOST_PEAK, rel=0.06)
    # nothing else changes
    np.testing.assert_allclose(after[:, :86], before[:, :86], rtol=1e-12)


def test_models_within_it_stay(planted, planted_measurement):
    assert peak.within_peak(planted, planted_measurement.f_r.max()) is planted


def test_a_fit_ends_with_it(glaring, planted_measurement, make_measurement, short_fit):
    """Where the last bins hold no measurement a fit is free there, and what it does is limited."""
    table = metrics.tabulate(glaring)
    seen = np.broadcast_to(np.arange(90)[:, None] < 84, (90, 90, 180))
    measurement = make_measurement(np.minimum(table, planted_measurement.f_r.max()), seen)
    model = fit.fit(measurement).model
    assert limits.limits(metrics.tabulate(model), measurement).peak_ratio < 3
