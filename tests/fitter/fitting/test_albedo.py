# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np

from fitter.fitting import albedo
from fitter.geometry import merl_bins
from fitter.grading import metrics
from fitter.models.tables import directional_albedo


def test_albedo_of_a_table_is_that_of_the_model(planted, planted_measurement):
    got = albedo.measured_albedo(metrics.tabulate(planted), planted_measurement)
    expected = directional_albedo(planted, np.radians(albedo.VIEW_ANGLES))
    # bins of 1 degree in theta_d against the model itself, and bins cut by the horizon
    np.testing.assert_allclose(got[:-2], expected[:-2], rtol=0.03)


def test_light_from_both_sides_counts(planted, make_measurement):
    """A file may tell wi from its mirror image; the albedo is that of all light."""
    bins = merl_bins()
    tilt = np.where(bins.above_horizon, np.sign(bins.cos_o - bins.cos_i), 0)[..., None]
    table = metrics.tabulate(planted)
    one_sided = make_measurement(table * (1 + 0.5 * tilt))
    theta = np.radians(np.array([10.0, 30.0, 60.0]))
    rng = np.random.default_rng(0)
    n = 200_000
    cos_i, phi = np.sqrt(rng.random(n)), rng.random(n) * 2 * np.pi
    sin_i = np.sqrt(1 - cos_i**2)
    wi = np.stack([sin_i * np.cos(phi), sin_i * np.sin(phi), cos_i], -1)
    sampled = []
    for angle in theta:
        wo = np.broadcast_to([np.sin(angle), 0, np.cos(angle)], wi.shape)
        sampled.append(np.pi * one_sided.lookup(wi, wo).mean(0))
    rows = [list(albedo.VIEW_ANGLES).index(angle) for angle in (10, 30, 60)]
    got = albedo.measured_albedo(one_sided.f_r, one_sided)
    np.testing.assert_allclose(got[rows], sampled, rtol=0.04)
    np.testing.assert_allclose(got, albedo.measured_albedo(table, one_sided), rtol=1e-2)


def test_bins_without_a_measurement_are_left_out(planted_measurement, make_measurement):
    holes = np.random.default_rng(0).random(planted_measurement.valid.shape) < 0.3
    f_r = planted_measurement.f_r
    with_holes = make_measurement(f_r, planted_measurement.valid & ~holes)
    whole = albedo.measured_albedo(f_r, planted_measurement)
    np.testing.assert_allclose(albedo.measured_albedo(f_r, with_holes), 0.7 * whole, rtol=0.1)
