# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import geometry, synthetic
from fitter.fitting import starts
from fitter.fitting.problem import Problem
from fitter.fitting.quality import QUALITIES


def ggx_material(alpha):
    return synthetic.AnalyticBrdf(
        diffuse=(0.1, 0.1, 0.1), lobes=(synthetic.GgxLobe(alpha=alpha, f0=(0.5, 0.5, 0.5)),)
    )


@pytest.fixture(scope="module")
def problem_of(make_measurement):
    def make(brdf):
        return Problem(make_measurement(*synthetic.tabulate(brdf)), phi_group=45, n_angles=60)

    return make


@pytest.fixture(scope="module")
def sharp(problem_of):
    return problem_of(ggx_material(0.06))


@pytest.mark.parametrize("alpha", [0.06, 0.12, 0.2])
def test_width_of_a_highlight(problem_of, alpha):
    """GGX falls to a half where alpha^2 / (cos^2 (alpha^2 - 1) + 1)^2 is half of alpha^-2."""
    theta = np.linspace(0, 0.6, 100001)
    d = alpha**2 / (np.cos(theta) ** 2 * (alpha**2 - 1) + 1) ** 2
    expected = theta[np.argmax(d < d[0] / 2)]
    got = starts.highlight_width(problem_of(ggx_material(alpha)))
    # to a bin, which is up to 2 degrees wide there
    assert got == pytest.approx(expected, rel=0.15)
    assert got < starts.SPECULAR_WIDTH


def test_sheen_is_no_highlight(make_measurement):
    """A maximum far from the normal, even where the data falls to a half behind it."""
    profile = 0.1 + np.exp(-(((np.arange(90) - 60) / 6) ** 2))
    table = np.broadcast_to(profile[:, None, None, None], (90, 90, 180, 3))
    problem = Problem(make_measurement(table), phi_group=45, n_angles=60)
    np.testing.assert_allclose(np.argmax(starts.highlight_profile(problem)), 60)
    assert starts.highlight_width(problem) == geometry.HALF_PI


def test_no_highlight_at_all(make_measurement):
    flat = Problem(make_measurement(np.full((90, 90, 180, 3), 0.2)), phi_group=45, n_angles=60)
    np.testing.assert_allclose(starts.highlight_profile(flat), 0, atol=1e-12)
    for start in starts.STARTS:
        model = start(flat)
        assert np.isfinite(model.ndf).all()
        np.testing.assert_allclose(model.diffuse, 0.8 * 0.2)


def test_start_follows_the_width_of_the_data(sharp, problem_of):
    def half_width(model):
        return [int(np.argmax(row < row[0] / 2)) for row in model.ndf]

    narrow, wide = (
        half_width(starts.start_from_width(p)) for p in (sharp, problem_of(ggx_material(0.2)))
    )
    assert narrow[0] < wide[0]
    theta_h = geometry.theta_h_centres()[narrow[0]]
    assert theta_h == pytest.approx(starts.highlight_width(sharp), rel=0.2)


def test_separated_lobes_are_those_of_the_data(make_measurement):
    """A table that is a sum of three products comes back as D (G / cos)^2 at theta_o = theta_d."""
    theta_h, theta_d = geometry.theta_h_centres()[:, None], geometry.theta_d_centres()
    mean = sum(
        height * np.exp(-((theta_h / width) ** 2)) * (1 + (theta_d / reach) ** 2)
        for height, width, reach in ((50, 0.05, 2.0), (3, 0.2, 0.7), (0.3, 0.8, 0.4))
    )
    table = np.broadcast_to(0.1 + mean[:, :, None, None], (90, 90, 180, 3))
    problem = Problem(make_measurement(table), phi_group=45, n_angles=60)
    model = starts.start_separated(problem)
    masking = model.evaluate_masking(theta_d) / np.cos(theta_d)
    lobes = model.scale[:, 0, None, None] * model.ndf[:, :, None] * masking[:, None] ** 2
    floor = np.quantile(table[problem.cell_weight.sum(2) > 0], starts.FLOOR_QUANTILE)
    seen = (problem.cell_weight.sum(2) > 0) & (mean > 1) & (theta_d < np.radians(85))
    np.testing.assert_allclose(lobes.sum(0)[seen], (0.1 + mean - floor)[seen], rtol=0.05)
    # no start of a fixed shape comes near
    assert not np.allclose(starts.start_from_width(problem).ndf, model.ndf, atol=0.1)


@pytest.mark.parametrize("start", starts.STARTS)
def test_starts_are_models_that_every_update_can_work_with(sharp, start):
    model = start(sharp)
    for name in ("scale", "ndf", "masking", "fresnel"):
        assert (getattr(model, name) > 0).all(), name
    np.testing.assert_allclose(model.ndf.max(1), 1)
    # below nearly all of the data, so that no lobe starts negative
    seen = sharp.cell_weight > 0
    mean = sharp.cell_target / np.where(seen, sharp.cell_weight, 1)
    assert (mean >= model.diffuse)[seen].mean() > 0.88
    again = start(sharp)
    np.testing.assert_array_equal(again.ndf, model.ndf)


def test_starts_differ(sharp):
    models = [start(sharp) for start in starts.STARTS]
    for i, one in enumerate(models):
        for other in models[:i]:
            assert np.abs(one.ndf - other.ndf).max() > 0.1


def test_there_are_enough_starts():
    assert len(starts.STARTS) >= max(work.starts for work in QUALITIES.values())
