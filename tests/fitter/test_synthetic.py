# SPDX-License-Identifier: GPL-3.0-or-later
import subprocess
import sys
import time
import tracemalloc

import numpy as np
import pytest

from fitter import geometry, polar_grid, synthetic
from fitter.errors import NfmError
from fitter.formats import merl, readers
from fitter.synthetic import SAMPLES, AnalyticBrdf, GgxLobe, SheenLobe
from tests.anisotropic_measurements import random_pairs

BLACK = (0.0, 0.0, 0.0)
GREY = (0.5, 0.5, 0.5)
EACH_SAMPLE = pytest.mark.parametrize("name", SAMPLES)


def direction(degrees, azimuth=0.0):
    theta, phi = np.radians(degrees), np.radians(azimuth)
    sin = np.sin(theta)
    return np.array([[sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)]])


def random_directions(rng, n):
    """Cosines from 1 down to 1e-9."""
    z = np.where(rng.random(n) < 0.5, rng.random(n), 10 ** rng.uniform(-9, 0, n))
    phi = rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)


def albedo(brdf, degrees, n=100_000):
    """Directional albedo (3,), Monte Carlo over cosine-weighted directions and GGX half vectors."""
    rng = np.random.default_rng(0)
    wo = direction(degrees)
    sin2, phi = rng.random(n), rng.uniform(0, 2 * np.pi, n)
    flat = np.stack(
        [np.sqrt(sin2) * np.cos(phi), np.sqrt(sin2) * np.sin(phi), np.sqrt(1 - sin2)], -1
    )
    alphas = 10 ** np.linspace(-2, -0.2, 32)
    theta = np.arctan(rng.choice(alphas, n) * np.sqrt(sin2 / (1 - sin2)))
    h = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    peaked = 2 * (h @ wo[0])[:, None] * h - wo
    wi = np.where((np.arange(n) % 2 == 0)[:, None], flat, peaked)
    wi = wi[wi[:, 2] > 1e-9]
    h = geometry.normalized(wi + wo)
    cos2 = h[:, 2] ** 2
    ndf = np.mean([a * a / (np.pi * (a * a * cos2 + 1 - cos2) ** 2) for a in alphas], axis=0)
    pdf = 0.5 * wi[:, 2] / np.pi + 0.5 * ndf * h[:, 2] / (4 * np.abs(h @ wo[0]))
    f_r = brdf.f_r(wi, np.broadcast_to(wo, wi.shape))
    return (f_r * (wi[:, 2] / pdf)[:, None]).sum(axis=0) / n


# --- values ---


def test_lambert():
    brdf = AnalyticBrdf(diffuse=(0.1, 0.5, 0.9))
    np.testing.assert_allclose(
        brdf.f_r(direction(20), direction(70, 130)), [np.array([0.1, 0.5, 0.9]) / np.pi]
    )


def test_ggx_head_on():
    # D = 1 / (pi alpha^2), G = 1, F = f0
    brdf = AnalyticBrdf(BLACK, (GgxLobe(alpha=0.2, f0=(0.04, 0.5, 1.0), weight=0.5),))
    expected = 0.5 * np.array([0.04, 0.5, 1.0]) / (4 * np.pi * 0.2**2)
    np.testing.assert_allclose(brdf.f_r(direction(0), direction(0)), [expected], rtol=1e-12)


def test_ggx_mirror_at_60_degrees():
    # theta_h = 0 and theta_d = 60 degrees: G1 = 2 / (1 + sqrt(1 + 3 alpha^2)), F by (1 - 1/2)^5
    alpha, f0 = 0.5, np.array([0.04, 0.5, 1.0])
    brdf = AnalyticBrdf(BLACK, (GgxLobe(alpha, tuple(f0)),))
    g1 = 2 / (1 + np.sqrt(1 + 3 * alpha**2))
    expected = (f0 + (1 - f0) / 32) * g1**2 / (np.pi * alpha**2) / (4 * 0.25)
    got = brdf.f_r(direction(60), direction(60, 180))
    np.testing.assert_allclose(got, [expected], rtol=1e-12)


def test_sheen_at_60_degrees():
    # wi = wo: theta_h = 60 degrees
    brdf = AnalyticBrdf(BLACK, (SheenLobe(0.5, (1.0, 0.5, 0.0)),))
    ndf = 4 * 0.75 / (2 * np.pi)
    expected = ndf / (4 * (0.5 + 0.5 - 0.25)) * np.array([1, 0.5, 0])
    np.testing.assert_allclose(brdf.f_r(direction(60), direction(60)), [expected], rtol=1e-12)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_ggx_distribution_is_normalised(alpha):
    # Walter et al. 2007: D cos_h integrates to 1; wi = wo = h and f0 = 1 single out D
    theta = (np.arange(200_000) + 0.5) / 200_000 * np.pi / 2
    angles = synthetic.PairAngles(
        np.ones_like(theta),
        np.ones_like(theta),
        np.cos(theta) ** 2,
        np.sin(theta) ** 2,
        np.ones_like(theta),
    )
    ndf = 4 * GgxLobe(alpha, (1.0, 1.0, 1.0)).f_r(angles)[:, 0]
    total = np.mean(ndf * np.cos(theta) * np.sin(theta)) * np.pi / 2 * 2 * np.pi
    assert total == pytest.approx(1, abs=1e-4)


def test_zero_below_the_horizon():
    brdf = SAMPLES["copper-paint"]
    up, level, down = direction(30), direction(90) * [1, 1, 0], direction(120)
    assert (brdf.f_r(up, up) > 0).all()
    for wi, wo in ((up, down), (down, up), (down, down), (up, level), (level, level)):
        np.testing.assert_array_equal(brdf.f_r(wi, wo), np.zeros((1, 3)))


# --- what a BRDF must be ---


@EACH_SAMPLE
def test_reciprocal_positive_isotropic(name):
    rng = np.random.default_rng(1)
    wi, wo = random_directions(rng, 20_000), random_directions(rng, 20_000)
    brdf = SAMPLES[name]
    value = brdf.f_r(wi, wo)
    assert np.isfinite(value).all()
    assert (value > 0).all()
    np.testing.assert_array_equal(value, brdf.f_r(wo, wi))
    turn = np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    np.testing.assert_allclose(brdf.f_r(wi @ turn, wo @ turn), value, rtol=1e-6)
    np.testing.assert_allclose(brdf.f_r(wi * [1, -1, 1], wo * [1, -1, 1]), value, rtol=1e-6)


@EACH_SAMPLE
def test_reflects_no_more_than_it_receives(name):
    for degrees in (0, 45, 75, 85, 89, 89.9):
        assert (albedo(SAMPLES[name], degrees) <= 1).all(), degrees


@EACH_SAMPLE
def test_samples_get_the_diffuse_term_they_ask_for(name):
    np.testing.assert_array_equal(SAMPLES[name].lambert_albedo, SAMPLES[name].diffuse)


def test_lambert_term_is_scaled_to_what_the_lobes_leave():
    brdf = AnalyticBrdf((1.0, 0.5, 0.0), (GgxLobe(0.1, (0.04, 0.04, 0.04)),))
    used = brdf.lambert_albedo
    assert used[0] < 0.75
    np.testing.assert_allclose(used / used[0], [1, 0.5, 0])  # the hue stays
    largest = max(albedo(brdf, degrees)[0] for degrees in (80, 87, 89.9))
    assert 0.97 < largest <= 1


@pytest.mark.parametrize("degrees", [0, 40, 80, 89])
@pytest.mark.parametrize(
    "lobe", [GgxLobe(0.04, GREY), GgxLobe(0.5, GREY), SheenLobe(0.25, GREY), SheenLobe(1.0, GREY)]
)
def test_albedo_of_a_lobe(lobe, degrees):
    estimate = albedo(AnalyticBrdf(BLACK, (lobe,)), degrees)
    np.testing.assert_allclose(lobe.albedo(np.radians(degrees)), estimate, atol=0.005)


def test_too_bright_lobes():
    bright = AnalyticBrdf(BLACK, (GgxLobe(0.1, (1.0, 1.0, 1.0)), GgxLobe(0.2, (0.5, 0.5, 0.5))))
    with pytest.raises(ValueError, match="expected at most 1"):
        bright.f_r(direction(0), direction(0))


@pytest.mark.parametrize(
    "make",
    [
        lambda: GgxLobe(0.0, GREY),
        lambda: GgxLobe(1.1, GREY),
        lambda: GgxLobe(float("nan"), GREY),
        lambda: GgxLobe(0.1, (0.5, 0.5, 1.5)),
        lambda: GgxLobe(0.1, (0.5, 0.5)),
        lambda: GgxLobe(0.1, GREY, weight=-1.0),
        lambda: SheenLobe(0.0, GREY),
        lambda: SheenLobe(0.3, (0.5, 0.5, float("nan"))),
        lambda: AnalyticBrdf((0.5, 0.5, -0.1)),
    ],
)
def test_values_out_of_range(make):
    with pytest.raises(ValueError, match="expected"):
        make()


# --- tables ---


def test_table_holds_the_values_at_the_bin_centres():
    brdf = SAMPLES["satin"]
    f_r, valid = synthetic.tabulate(brdf)
    assert f_r.shape == (90, 90, 180, 3)
    np.testing.assert_array_equal(valid, geometry.merl_bins().above_horizon)
    assert (f_r[~valid] == 0).all()
    rng = np.random.default_rng(3)
    bins = np.argwhere(valid)[rng.integers(0, np.count_nonzero(valid), 500)]
    i, j, k = bins.T
    wi, wo = geometry.directions_from_rusinkiewicz(
        ((i + 0.5) / 90) ** 2 * np.pi / 2, np.radians(j + 0.5), np.radians(k + 0.5)
    )
    np.testing.assert_allclose(f_r[i, j, k], brdf.f_r(wi, wo), rtol=1e-12)


def test_table_is_quick_and_small():
    brdf = SAMPLES["satin"]
    start = time.process_time()
    synthetic.tabulate(brdf, 0.02, np.random.default_rng(0))
    assert time.process_time() - start < 3  # 0.3 s on an idle machine
    tracemalloc.start()
    synthetic.tabulate(brdf)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 120e6


def test_noise_is_multiplicative_and_keeps_the_mean():
    brdf = AnalyticBrdf(GREY)
    clean, valid = synthetic.tabulate(brdf)
    noisy, same_valid = synthetic.tabulate(brdf, 0.2, np.random.default_rng(5))
    np.testing.assert_array_equal(valid, same_valid)
    ratio = noisy[valid] / clean[valid]
    assert ratio.mean() == pytest.approx(1, abs=1e-3)
    assert np.log(ratio).std() == pytest.approx(0.2, abs=1e-3)
    again, _ = synthetic.tabulate(brdf, 0.2, np.random.default_rng(5))
    np.testing.assert_array_equal(noisy, again)
    assert (noisy[~valid] == 0).all()


@pytest.mark.parametrize(("noise", "rng"), [(0.1, None), (-0.1, np.random.default_rng(0))])
def test_noise_needs_an_rng_and_a_size(noise, rng):
    with pytest.raises(ValueError, match="expected"):
        synthetic.tabulate(AnalyticBrdf(GREY), noise, rng)


def test_write_sample(tmp_path):
    path = tmp_path / "paint.binary"
    synthetic.write_sample(path, "copper-paint")
    measurement = merl.read(path)
    path.unlink()
    f_r, valid = synthetic.tabulate(SAMPLES["copper-paint"])
    np.testing.assert_array_equal(measurement.valid, valid)
    np.testing.assert_allclose(measurement.f_r, f_r, rtol=1e-15)


def test_unknown_sample(tmp_path):
    with pytest.raises(NfmError, match="no such sample, there are rough-plastic"):
        synthetic.write_sample(tmp_path / "x.binary", "gold")
    assert not (tmp_path / "x.binary").exists()


@pytest.mark.parametrize(
    ("options", "brdf", "noise"),
    [
        (
            [
                "ggx",
                "--param",
                "alpha=0.15",
                "--param",
                "f0=0.9,0.6,0.04",
                "--param",
                "diffuse=0.05,0.1,0.2",
            ],
            AnalyticBrdf((0.05, 0.1, 0.2), (GgxLobe(0.15, (0.9, 0.6, 0.04)),)),
            0.0,
        ),
        (
            ["ggx2", "--param", "diffuse=0", "--noise", "0.05", "--seed", "3"],
            AnalyticBrdf(
                BLACK, (GgxLobe(0.05, (0.9, 0.6, 0.5), 0.6), GgxLobe(0.4, (0.6, 0.5, 0.45), 0.4))
            ),
            0.05,
        ),
    ],
    ids=["ggx", "ggx2-with-noise"],
)
def test_tables_agree_with_the_other_generator(tmp_path, shared, options, brdf, noise):
    path = tmp_path / "other.binary"
    subprocess.run(
        [sys.executable, shared / "tools" / "make_merl.py", path, "--analytic", *options],
        check=True,
        capture_output=True,
        timeout=120,
    )
    other = merl.read(path)
    path.unlink()
    f_r, valid = synthetic.tabulate(brdf, noise, np.random.default_rng(3))
    np.testing.assert_array_equal(other.valid, valid)
    np.testing.assert_allclose(other.f_r, f_r, rtol=1e-9)


# --- anisotropic samples ---


@pytest.mark.parametrize("name", synthetic.ANISOTROPIC_SAMPLES)
def test_anisotropic_samples_are_brdfs(name):
    """Reciprocal, and no view reflects more than it receives; only above the horizon."""
    brdf = synthetic.ANISOTROPIC_SAMPLES[name]
    rng = np.random.default_rng(0)
    wi, wo = random_pairs(rng, 2000)
    forth = brdf.f_r(wi, wo)
    assert (forth > 0).all()
    np.testing.assert_allclose(brdf.f_r(wo, wi), forth, rtol=1e-12)
    np.testing.assert_array_equal(brdf.f_r(wi * [1, 1, -1], wo), 0)
    z, phi = np.sqrt(rng.random(100_000)), rng.uniform(0, 2 * np.pi, 100_000)
    lights = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1)
    for view in polar_grid.directions()[[0, 60, 150, 240, 251]]:
        albedo = np.pi * brdf.f_r(lights, np.broadcast_to(view, lights.shape)).mean(0)
        assert albedo.max() < 1


def test_equal_roughnesses_are_the_isotropic_lobe():
    wi, wo = random_pairs(np.random.default_rng(1), 500)
    same = synthetic.AnisotropicGgxLobe(0.3, 0.3, (0.9, 0.5, 0.1), rotation=33.0, weight=0.7)
    isotropic = synthetic.GgxLobe(0.3, (0.9, 0.5, 0.1), weight=0.7)
    expected = isotropic.f_r(synthetic._pair_angles(wi, wo))
    np.testing.assert_allclose(same.f_r(wi, wo), expected, rtol=1e-9)


def test_anisotropic_lobe_spreads_across_its_tangent():
    up = np.array([[0.0, 0.0, 1.0]])
    for rotation, along, across in ((0.0, [0.5, 0.0], [0.0, 0.5]), (90.0, [0.0, 0.5], [0.5, 0.0])):
        lobe = synthetic.AnisotropicGgxLobe(0.1, 0.5, (1.0, 1.0, 1.0), rotation=rotation)
        values = [lobe.f_r(np.array([[*xy, np.sqrt(0.75)]]), up)[0, 0] for xy in (along, across)]
        assert values[1] > 5 * values[0]


@pytest.mark.parametrize("name", synthetic.ANISOTROPIC_SAMPLES)
def test_anisotropic_samples_are_utia_files(tmp_path, name):
    path = tmp_path / f"{name}.bin"
    synthetic.write_sample(path, name)
    measurement = readers.read(path)
    assert measurement.source.format == "utia-bin"
    w = polar_grid.directions()
    expected = synthetic.ANISOTROPIC_SAMPLES[name].f_r(w[100:101], w[200:201])[0]
    np.testing.assert_array_equal(measurement.f_r.reshape(288, 288, 3)[100, 200], expected)


@pytest.mark.parametrize("wrong", [{"alpha_x": 0.0}, {"alpha_y": 1.5}, {"f0": (1.0, 2.0, 0.0)}])
def test_anisotropic_lobe_refuses(wrong):
    with pytest.raises(ValueError, match="expected"):
        synthetic.AnisotropicGgxLobe(**({"alpha_x": 0.2, "alpha_y": 0.4, "f0": (1, 1, 1)} | wrong))


def test_anisotropic_samples_have_no_noise(tmp_path):
    with pytest.raises(NfmError, match="without noise"):
        synthetic.write_sample(tmp_path / "x.bin", "shot-silk", noise=0.1)
