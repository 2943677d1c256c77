# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import geometry
from fitter.fitting.problem import Problem, amplitudes
from fitter.fitting.weights import sample_weights
from fitter.grading import metrics


@pytest.fixture(scope="module")
def uneven(make_measurement):
    """Neither smooth nor reciprocal, with holes that are not symmetric either."""
    rng = np.random.default_rng(0)
    f_r = rng.uniform(0.01, 2, (90, 90, 180, 3))
    return make_measurement(f_r, rng.random(f_r.shape[:3]) > 0.2)


def snapped_masking(model, cosine, n_angles):
    """G / cos of each lobe at the centre of the angle bin that holds arccos(cosine)."""
    index = np.minimum(np.floor(np.arccos(cosine) / (np.pi / 2) * n_angles), n_angles - 1)
    theta = (index + 0.5) / n_angles * np.pi / 2
    points = model.masking
    first, last = points[:, 1:2], 2 * points[:, -1:] - points[:, -2:-1]
    padded = np.concatenate([first, points, last], 1)
    position = theta / (np.pi / 2) * 89
    k = np.minimum(position.astype(int), 88)
    t = position - k
    a, b, c, d = (padded[:, k + n] for n in range(4))
    value = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    return value / np.cos(theta)


def brute_force(measurement, model, weight, phi_group, n_angles):
    """E of eq. 2 with a sum over all bins; phi_d stands for itself or for its group's middle."""
    k = np.arange(90)
    stand_in = k // phi_group * phi_group + phi_group // 2
    stand_in = np.concatenate([stand_in, 179 - stand_in[::-1]])
    bins = geometry.merl_bins()
    valid = measurement.valid & bins.above_horizon
    error = energy = 0.0
    weights = list(sample_weights(measurement, weight))
    for h in range(90):
        u_i, u_o = (
            snapped_masking(model, np.clip(c[h][:, stand_in], 0, 1), n_angles)
            for c in (bins.cos_i, bins.cos_o)
        )
        lobes = model.ndf[:, h, None, None] * u_i * u_o
        for c in range(3):
            f = model.diffuse[c] + model.fresnel[c][:, None] * (
                model.scale[:, c, None, None] * lobes
            ).sum(0)
            rho = measurement.f_r[h, ..., c]
            w = np.where(valid[h], weights[c][h], 0)
            error += (w * (f - rho) ** 2).sum()
            energy += (w * rho**2).sum()
    return error / energy


@pytest.mark.parametrize(
    ("weight", "phi_group", "n_angles"),
    [("display-gamma", 1, 360), ("display-gamma", 9, 120), ("log", 45, 61), ("linear", 15, 90)],
)
def test_objective_is_the_sum_over_all_bins(uneven, random_model, weight, phi_group, n_angles):
    model = random_model(0)
    problem = Problem(uneven, weight=weight, phi_group=phi_group, n_angles=n_angles)
    expected = brute_force(uneven, model, weight, phi_group, n_angles)
    assert problem.objective_of(model) == pytest.approx(expected, rel=1e-9)


def test_swapped_pairs_share_a_sample_exactly(uneven):
    problem = Problem(uneven, n_angles=90)
    weights = list(sample_weights(uneven, "display-gamma"))
    h, d, k = 20, 30, 11
    expected = np.zeros(3)
    for p in (k, 179 - k):
        expected += [w[h, d, p] for w in weights]
    np.testing.assert_allclose(problem.weight[h * 90 + d, k], expected, rtol=1e-12)


def test_perfect_model_has_almost_no_error(planted, planted_measurement):
    # only the snapping of theta_i and theta_o to angle bins is left
    errors = [
        Problem(planted_measurement, n_angles=n, phi_group=3).objective_of(planted)
        for n in (180, 720)
    ]
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 2


def test_error_of_a_perfect_model_is_not_negative(make_measurement, planted):
    """What rounding makes of a difference that is 0; the joint steps take its square root."""
    levels = np.random.default_rng(0).uniform(1e-9, 1, (12, 3))
    errors = []
    for level in levels:
        f_r = np.broadcast_to(level, (90, 90, 180, 3))
        problem = Problem(make_measurement(f_r), n_angles=60, phi_group=45)
        matte = replace(planted, diffuse=level, scale=np.full((3, 3), 1e-28))
        errors.append(problem.objective_of(matte))
    assert min(errors) >= 0
    assert max(errors) < 1e-13


def test_groups_of_phi_d_hardly_matter_for_a_smooth_material(two_lobes, planted):
    fine, grouped = (
        Problem(two_lobes, phi_group=n, n_angles=360).objective_of(planted) for n in (1, 3)
    )
    assert fine > 0.01
    assert grouped == pytest.approx(fine, rel=2e-3)


def test_no_model_has_error_one(uneven, random_model):
    problem = Problem(uneven, phi_group=45, n_angles=60)
    model = random_model(1)
    black = type(model)(*(0 * a for a in vars(model).values()))
    assert problem.objective_of(black) == pytest.approx(1, rel=1e-12)


def test_masked_bins_do_not_matter(uneven, random_model):
    rng = np.random.default_rng(1)
    garbage = np.where(uneven.valid[..., None], uneven.f_r, rng.choice([1e9, 0, 3], (180, 3)))
    # bins below the horizon do not count even if they are said to be valid
    valid = uneven.valid | ~geometry.merl_bins().above_horizon
    dirty = type(uneven)(garbage, valid, uneven.source, uneven.report)
    clean = Problem(uneven, phi_group=9, n_angles=120)
    other = Problem(dirty, phi_group=9, n_angles=120)
    assert other.target_energy == clean.target_energy
    np.testing.assert_array_equal(other.weight, clean.weight)
    np.testing.assert_array_equal(other.weighted_target, clean.weighted_target)
    assert other.objective_of(random_model(2)) == clean.objective_of(random_model(2))


def test_moments(coarse, random_model):
    model = random_model(3)
    kernels = coarse.kernels(model.masking)
    moments = coarse.moments(kernels)
    for h, d in ((0, 0), (3, 40), (60, 20), (89, 0), (50, 50)):
        weight, target = coarse.weight[h * 90 + d], coarse.weighted_target[h * 90 + d]
        kernel = kernels[:, h * 90 + d]
        for m in range(3):
            for c in range(3):
                one = sum(w * k for w, k in zip(weight[:, c], kernel[m], strict=True))
                rho = sum(t * k for t, k in zip(target[:, c], kernel[m], strict=True))
                assert moments.kernel[h, d, m, c] == pytest.approx(one, rel=1e-11)
                assert moments.kernel_target[h, d, m, c] == pytest.approx(rho, rel=1e-11)
                for k in range(3):
                    two = (weight[:, c] * kernel[m] * kernel[k]).sum()
                    assert moments.kernel_kernel[h, d, m, k, c] == pytest.approx(two, rel=1e-11)


def test_kernels_are_masking_over_cosines(coarse, random_model):
    model = random_model(4)
    kernels = coarse.kernels(model.masking)
    bins = geometry.merl_bins()
    for h, d, group in ((0, 10, 0), (30, 30, 4), (45, 60, 9)):
        k = group * 9 + 4
        cosines = np.array([bins.cos_i[h, d, k], bins.cos_o[h, d, k]])
        u = snapped_masking(model, np.clip(cosines, 0, 1), 120)
        expected = u[:, 0] * u[:, 1]
        np.testing.assert_allclose(kernels[:, h * 90 + d, group], expected, rtol=1e-11)


def test_amplitudes(random_model):
    model = random_model(5)
    got = amplitudes(model)
    assert got.shape == (90, 90, 3, 3)
    for h, d, m, c in ((0, 1, 2, 0), (40, 89, 0, 1), (89, 5, 1, 2)):
        expected = model.scale[m, c] * model.ndf[m, h] * model.fresnel[c, d]
        assert got[h, d, m, c] == pytest.approx(expected, rel=1e-14)


def test_tables_over_angle_bins(tiny):
    rng = np.random.default_rng(6)
    values = rng.random(tiny.bin_i.shape)
    u = rng.random(tiny.n_angles)
    pairs = np.zeros((tiny.n_angles, tiny.n_angles))
    angles = np.zeros((2, 90, tiny.n_angles))
    for (cell, p), value in np.ndenumerate(values):
        i, o = tiny.bin_i[cell, p], tiny.bin_o[cell, p]
        pairs[i, o] += value
        for axis, row in enumerate(divmod(cell, 90)):
            angles[axis, row, i] += value * u[o]
            angles[axis, row, o] += value * u[i]
    np.testing.assert_allclose(tiny.pair_table(values), pairs, rtol=1e-10)
    for axis in (0, 1):
        got = tiny.angle_table(values, u, axis)
        np.testing.assert_allclose(got, angles[axis], rtol=1e-10)


def test_objective_agrees_with_the_model_itself(planted, planted_measurement):
    # no snapping in this sum: the model's own f_r at the bin centres
    model = replace(planted, diffuse=np.array([0.1, 0.02, 0.3]), scale=planted.scale[::-1])
    table = metrics.tabulate(model)
    rho = planted_measurement.f_r
    w = np.stack(list(sample_weights(planted_measurement, "display-gamma")), -1)
    expected = (w * (table - rho) ** 2).sum() / (w * rho**2).sum()
    got = Problem(planted_measurement, n_angles=720).objective_of(model)
    assert got == pytest.approx(expected, rel=5e-3)


def test_unreachable_is_the_least_squares_of_free_samples(two_lobes, make_measurement):
    """Without noise: what is left if every sample has a value of its own."""
    rng = np.random.default_rng(0)
    one_sided = two_lobes.f_r * np.where(np.arange(180) < 90, 0.9, 1.1)[:, None]
    problem = Problem(make_measurement(one_sided, two_lobes.valid))
    assert problem.unreachable == pytest.approx(0.01, rel=0.02)
    assert Problem(two_lobes).unreachable < 1e-6
    # noise of 10 % in values whose pairs agree
    half = np.exp(0.1 * rng.standard_normal((90, 90, 90, 3)))
    noise = np.concatenate([half, half[:, :, ::-1]], axis=2)
    noisy = Problem(make_measurement(two_lobes.f_r * noise, two_lobes.valid))
    assert noisy.unreachable == pytest.approx(0.01, rel=0.1)
