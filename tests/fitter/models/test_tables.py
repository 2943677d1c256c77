# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import geometry
from fitter.models import tables


@pytest.fixture(scope="module")
def lobes(planted, ggx):
    """A mirror-like lobe, a glossy one and a rough one."""
    return replace(planted, ndf=np.stack([ggx(alpha) for alpha in (0.003, 0.1, 0.5)])).normalized()


def density_at(tables_, lobe, v):
    return np.interp(v, tables.versine_nodes(), tables_.density[lobe])


def fine_theta():
    """Midpoints and widths of theta, dense at 0, where a mirror-like lobe has all its energy."""
    edges = np.linspace(0, 1, 400_001) ** 3 * np.pi / 2
    return (edges[1:] + edges[:-1]) / 2, np.diff(edges)


def test_nodes():
    nodes = tables.versine_nodes()
    assert nodes.shape == (92,)
    assert (np.diff(nodes) > 0).all()
    np.testing.assert_allclose(nodes[1:-1], 1 - np.cos(geometry.theta_h_centres()), atol=1e-15)


def test_density_integrates_to_one(lobes):
    got = tables.sampling_tables(lobes)
    theta, width = fine_theta()
    for lobe in range(3):
        density = density_at(got, lobe, 2 * np.sin(theta / 2) ** 2)
        total = (2 * np.pi * density * np.sin(theta) * width).sum()
        assert total == pytest.approx(1, rel=1e-5)


def test_density_is_proportional_to_d_cos(lobes):
    got = tables.sampling_tables(lobes)
    expected = lobes.ndf * np.cos(geometry.theta_h_centres())
    ratio = got.density[:, 1:-1] / expected
    np.testing.assert_allclose(ratio, ratio[:, :1] * np.ones(90), rtol=1e-12)
    # between the nodes too it must never starve a direction that D fills
    theta = geometry.theta_h_from_index(np.linspace(0, 89, 2000))
    at_theta = lobes.evaluate_ndf(theta) * np.cos(theta)
    for lobe in range(3):
        share = density_at(got, lobe, geometry.versine(theta)) / (ratio[lobe, 0] * at_theta[lobe])
        assert share.min() > 0.7
        assert share.max() < 1.5


def test_cumulative_is_the_integral_of_the_density(lobes):
    got = tables.sampling_tables(lobes)
    nodes = tables.versine_nodes()
    for lobe in range(3):
        for k in range(91):
            v = np.linspace(nodes[k], nodes[k + 1], 9)
            density = density_at(got, lobe, v)
            area = 2 * np.pi * ((density[1:] + density[:-1]) / 2 * np.diff(v)).sum()
            step = got.cumulative[lobe, k + 1] - got.cumulative[lobe, k]
            assert step == pytest.approx(area, rel=1e-9, abs=1e-15)
    np.testing.assert_array_equal(got.cumulative[:, 0], 0)
    np.testing.assert_allclose(got.cumulative[:, -1], 1, rtol=1e-15)
    assert (np.diff(got.cumulative, axis=1) >= 0).all()


def test_normalisation_of_equations_8_and_9_on_the_true_grid(lobes):
    # eq. 8 as a sum over bins, but with the true width of each bin
    got = tables.sampling_tables(lobes)
    edges = geometry.theta_h_from_index(np.arange(91))
    bins = 2 * np.pi * np.diff(1 - np.cos(edges))
    total = got.density[:, 1:-1] @ bins
    np.testing.assert_allclose(total[1:], 1, rtol=3e-3)
    # a lobe four bins wide is coarse for a sum over bins
    assert total[0] == pytest.approx(1, rel=0.08)


def sample(got, lobe, u):
    """Invert the piecewise quadratic integral of the density."""
    nodes, density, cumulative = tables.versine_nodes(), got.density[lobe], got.cumulative[lobe]
    k = np.clip(np.searchsorted(cumulative, u, side="right") - 1, 0, 90)
    a, b = density[k], density[k + 1]
    share = (u - cumulative[k]) / (cumulative[k + 1] - cumulative[k])
    t = share * (a + b) / (a + np.sqrt(a * a + share * (b * b - a * a)))
    return nodes[k] + t * (nodes[k + 1] - nodes[k])


@pytest.mark.parametrize("lobe", range(3))
def test_samples_follow_d_cos(lobes, lobe):
    got = tables.sampling_tables(lobes)
    n = 200_000
    v = sample(got, lobe, np.random.default_rng(lobe).random(n))
    assert v.min() >= 0
    assert v.max() <= 1

    # expected counts by an integral over theta of D cos, D linear in v between its nodes
    theta, width = fine_theta()
    nodes = tables.versine_nodes()
    ndf = lobes.ndf[lobe] * np.cos(geometry.theta_h_centres())
    d_cos = np.concatenate([[lobes.ndf[lobe, 0]], ndf, [0]])
    mass = np.interp(2 * np.sin(theta / 2) ** 2, nodes, d_cos) * np.sin(theta) * width
    cumulative = np.cumsum(mass) / mass.sum()
    splits = theta[np.searchsorted(cumulative, np.arange(1, 64) / 64)]
    edges = np.concatenate([[0], 2 * np.sin(splits / 2) ** 2, [1]])
    at = np.searchsorted(theta, splits)
    expected = n * np.diff(np.concatenate([[0], cumulative[at], [1]]))
    counts = np.histogram(v, edges)[0]
    chi2 = ((counts - expected) ** 2 / expected).sum()
    # 63 degrees of freedom: mean 63, standard deviation 11.2
    assert chi2 < 63 + 4 * 11.2


def test_lobe_without_d_gets_a_cosine(planted):
    ndf = planted.ndf.copy()
    ndf[1] = 0
    got = tables.sampling_tables(replace(planted, ndf=ndf))
    np.testing.assert_allclose(got.density[1], (1 - tables.versine_nodes()) / np.pi, rtol=1e-12)
    assert np.isfinite(got.cumulative).all()


def hemisphere(n=400):
    """Directions and solid angles of a midpoint grid, uniform in cos^2 and azimuth."""
    cos, phi = np.meshgrid(
        np.sqrt((np.arange(n) + 0.5) / n), (np.arange(n) + 0.5) / n * np.pi, indexing="ij"
    )
    sin = np.sqrt(1 - cos**2)
    wi = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], -1).reshape(-1, 3)
    return wi, np.full(len(wi), np.pi / len(wi))  # cos dw


@pytest.fixture(scope="module")
def rough(planted, ggx):
    return replace(planted, ndf=np.stack([ggx(alpha) for alpha in (0.35, 0.5, 0.8)]))


@pytest.mark.parametrize("degrees", [0, 30, 60, 80])
def test_directional_albedo(rough, degrees):
    theta = np.radians(degrees)
    wi, measure = hemisphere()
    wo = np.broadcast_to([np.sin(theta), 0, np.cos(theta)], wi.shape)
    expected = measure @ rough.f_r(wi, wo)
    got = tables.directional_albedo(rough, np.array([theta]))
    assert got.shape == (1, 3)
    np.testing.assert_allclose(got[0], expected, rtol=2e-3)


def test_directional_albedo_of_a_diffuse_material(planted):
    model = replace(planted, scale=np.zeros((3, 3)))
    got = tables.directional_albedo(model, np.radians([0, 45, 89]))
    np.testing.assert_allclose(got, np.pi * planted.diffuse * np.ones((3, 1)), rtol=1e-14)
    expected = np.pi * planted.diffuse.max()
    assert tables.largest_directional_albedo(model) == pytest.approx(expected, rel=1e-14)


def test_largest_albedo(planted):
    angles = np.radians(np.arange(0, 89))
    dense = tables.directional_albedo(planted, angles).max()
    assert tables.largest_directional_albedo(planted) == pytest.approx(dense, rel=0.02)


def test_selection_table(planted):
    got = tables.selection_table(planted)
    assert got.shape == (3, 31, 3)
    fine = tables.lobe_albedo(planted, np.radians(np.arange(0, 88, 3)))
    np.testing.assert_allclose(got[:, :30].transpose(1, 0, 2), fine, rtol=0.05)
    assert np.isfinite(got).all()
    assert (got[:, 30] >= 0).all()


def test_lobe_albedos_add_up(planted):
    theta = np.radians([10, 70])
    lobes = tables.lobe_albedo(planted, theta)
    assert lobes.shape == (2, 3, 3)
    total = tables.directional_albedo(planted, theta)
    np.testing.assert_allclose(lobes.sum(1) + np.pi * planted.diffuse, total, rtol=1e-14)
