# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures as functions; tests/render/test_closures.py compares them with what Cycles does."""

import numpy as np
import pytest

from fitter.geometry import normalized
from fitter.quadrature import view_quadrature
from fitter.shading import closures
from fitter.shading.base_catalogue import CATALOGUE
from fitter.shading.closures import RAMP_COLOURS, Closure

MICROFACETS = [Closure(kind, alpha) for kind in ("ggx", "beckmann") for alpha in (0.02, 0.2, 0.8)]
PHONG_RAMPS = [
    Closure("phong_ramp", 0),
    Closure("phong_ramp", 30),
    Closure("phong_ramp", 8, lean=0.5),
    Closure("phong_ramp", 40, lean=1.0),
    Closure("phong_ramp", 12, lean=-0.3),
    Closure("phong_ramp", 300, lean=-0.6),
]
RAMPS = [Closure("diffuse_ramp"), *PHONG_RAMPS]
VIEWS = np.radians([0, 20, 45, 70, 88])


def direction(theta):
    """Unit (3,) in the plane of incidence, on the side of the viewer."""
    return np.array([np.sin(theta), 0, np.cos(theta)])


@pytest.fixture
def around():
    """Unit directions (n, 3) all around, a third of them below the horizon."""
    raised = np.random.default_rng(0).normal((0, 0, 0.4), 1, (3000, 3))
    # up and along the horizon too
    return normalized(np.concatenate([raised, np.eye(3)]))


@pytest.fixture
def above(around):
    return around[around[:, 2] > 0]


def smith_lambda(kind, alpha, cosine):
    tangent = np.maximum(alpha * np.sqrt(1 - cosine**2) / cosine, 1e-9)
    if kind == "ggx":
        return (np.sqrt(1 + tangent**2) - 1) / 2
    # Walter et al. 2007: G1 = (3.535 a + 2.181 a^2) / (1 + 2.276 a + 2.577 a^2) below a = 1.6
    a = 1 / tangent
    g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    return 1 / g1 - 1


def plain(closure, wi, wo):
    """f cos(theta_i) (n,) with all numbers 1, as text books have it."""
    if closure.kind == "phong_ramp":
        tilt = closure.leaning(np.arctan2(wo[0], wo[2]))
        axis = direction(tilt)
        reflected = 2 * (wo @ axis) * axis - wo
        lobe = np.clip(wi @ reflected, 0, None) ** closure.parameter * (wi @ reflected > 0)
        return lobe * np.clip(wi @ axis, 0, None) * (closure.parameter + 2) / (2 * np.pi)
    alpha, h = closure.parameter, normalized(wi + wo)
    tan2 = (h[:, 0] ** 2 + h[:, 1] ** 2) / h[:, 2] ** 2
    if closure.kind == "ggx":
        ndf = 1 / (np.pi * alpha**2 * h[:, 2] ** 4 * (1 + tan2 / alpha**2) ** 2)
    else:
        ndf = np.exp(-tan2 / alpha**2) / (np.pi * alpha**2 * h[:, 2] ** 4)
    lambdas = smith_lambda(closure.kind, alpha, wi[:, 2]) + smith_lambda(closure.kind, alpha, wo[2])
    return ndf / (4 * wo[2] * (1 + lambdas))


# ---- columns ----


@pytest.mark.parametrize("theta_o", VIEWS)
@pytest.mark.parametrize("closure", [*MICROFACETS, *PHONG_RAMPS], ids=str)
def test_columns_sum_to_the_plain_closure(closure, theta_o, above):
    wo = direction(theta_o)
    expected = plain(closure, above, wo)
    found = closure.columns(above, wo).sum(0)
    np.testing.assert_allclose(found, expected, rtol=2e-3, atol=1e-9 * expected.max())


def test_diffuse_ramp_is_a_ramp_over_the_cosine(above):
    """Cycles multiplies by no cosine: it is the position on the ramp."""
    columns = Closure("diffuse_ramp").columns(above, direction(1))
    np.testing.assert_allclose(columns.sum(0), 1 / np.pi, rtol=1e-12)
    linear = np.arange(8) / 7 @ columns
    np.testing.assert_allclose(linear, above[:, 2] / np.pi, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("closure", [*MICROFACETS, *RAMPS], ids=str)
@pytest.mark.parametrize("theta_o", VIEWS)
def test_columns_are_finite_and_not_negative(closure, theta_o, around):
    columns = closure.columns(around, direction(theta_o))
    assert columns.shape == (closure.n_columns, len(around))
    assert np.isfinite(columns).all()
    assert (columns >= 0).all()
    assert (columns[:, around[:, 2] <= 0] == 0).all()
    assert columns.max() > 0


@pytest.mark.parametrize("closure", [*MICROFACETS, *RAMPS], ids=str)
def test_grazing_views_stay_finite(closure, around):
    for cosine in (1e-3, 1e-9, 0.0):
        assert np.isfinite(closure.columns(around, direction(np.arccos(cosine)))).all()


@pytest.mark.parametrize("closure", RAMPS, ids=str)
def test_colours_of_a_ramp_are_hats(closure, above):
    """Each position lies between two colours, which share it."""
    assert closure.signed
    assert closure.n_columns == RAMP_COLOURS == 8
    wo = direction(0.6)
    shares = closure.columns(above, wo)
    total = shares.sum(0)
    shares = shares[:, total > 1e-12] / total[total > 1e-12]
    lit = shares > 1e-9
    assert (lit.sum(0) <= 2).all()
    first, last = lit.argmax(0), 7 - lit[::-1].argmax(0)
    assert (last - first <= 1).all()
    # where the ramp stands
    if closure.kind == "diffuse_ramp":
        position = above[:, 2]
    else:
        axis = direction(closure.leaning(0.6))
        position = np.clip(above @ (2 * (wo @ axis) * axis - wo), 0, None) ** closure.parameter
    np.testing.assert_allclose(np.arange(8) / 7 @ shares, position[total > 1e-12], atol=1e-9)


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
def test_fresnel_columns(closure, above):
    """The first is the reflectance at normal incidence, the second at grazing."""
    assert not closure.signed
    assert closure.n_columns == 2
    wo = direction(np.radians(50))
    cos_d = normalized(above + wo) @ wo
    f0, f90 = closure.columns(above, wo)
    rise = (1 - cos_d) ** 5
    np.testing.assert_allclose(f90, (f0 + f90) * rise, rtol=1e-9, atol=1e-15 * f0.max())
    facing = closure.columns(direction(0)[None], direction(0))
    assert facing[1] == 0
    # at 90 degrees between the directions and the half vector nothing of F0 is left
    f0, f90 = closure.columns(direction(-np.radians(89.9))[None], direction(np.radians(89.9)))
    assert f0 < 0.01 * f90


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
def test_microfacets_are_reciprocal(closure, above):
    """f = columns / cos_i."""
    for theta_o in VIEWS:
        wo = direction(theta_o)
        there = closure.columns(above, wo) / above[:, 2]
        back = [closure.columns(wo[None], wi)[:, 0] / wo[2] for wi in above[::50]]
        np.testing.assert_allclose(there[:, ::50].T, back, rtol=1e-9, atol=1e-99)


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
@pytest.mark.parametrize("theta_o", VIEWS[:-1])
def test_microfacets_do_not_create_light(closure, theta_o):
    view = view_quadrature(theta_o, 96, 16)
    albedo = (closure.columns(view.wi, view.wo).sum(0) * view.solid_angle).sum()
    assert albedo < 1.002
    if closure.parameter == 0.02:
        assert albedo > 0.98


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
def test_half_vectors_are_normalised(closure):
    """The integral of D cos(theta_h) over h is 1; seen from above, up to 45 degrees count."""
    alpha = closure.parameter
    view = view_quadrature(0.0, 200, 32)
    smith = 1 + smith_lambda(closure.kind, alpha, view.wi[:, 2])
    h = normalized(view.wi + view.wo)
    # f cos_i = D G / (4 cos_o), dwi = 4 cos_d dh
    ndf_cos = closure.columns(view.wi, view.wo).sum(0) * smith * h[:, 2] / (h @ view.wo)
    beyond = alpha**2 / (1 + alpha**2) if closure.kind == "ggx" else np.exp(-1 / alpha**2)
    found = (ndf_cos * view.solid_angle).sum()
    assert found == pytest.approx(1 - beyond, abs=1e-2 * alpha + 1e-4)


# ---- densities ----


@pytest.mark.parametrize("theta_o", VIEWS[:-1])
@pytest.mark.parametrize(
    "closure",
    [
        Closure("diffuse_ramp"),
        Closure("phong_ramp", 1000),
        Closure("phong_ramp", 1000, lean=0.5),
        Closure("phong_ramp", 1000, lean=1.0),
    ],
    ids=str,
)
def test_density_is_normalised(closure, theta_o):
    view = view_quadrature(theta_o, 300, 100)
    total = (closure.density(view.wi, view.wo) * view.solid_angle).sum()
    # points lie less densely around a lobe that is not the mirror's
    assert total == pytest.approx(1, abs=1e-2 if closure.lean else 2e-3)


@pytest.mark.parametrize("theta_o", VIEWS)
@pytest.mark.parametrize("closure", PHONG_RAMPS, ids=str)
def test_density_is_at_most_normalised(closure, theta_o):
    """The part below the horizon is lost."""
    view = view_quadrature(theta_o, 200, 50)
    total = (closure.density(view.wi, view.wo) * view.solid_angle).sum()
    assert 0.4 < total < 1.01


@pytest.mark.parametrize("closure", PHONG_RAMPS, ids=str)
def test_density_goes_with_the_value(closure, above):
    wo = direction(0.7)
    n, cos_i = closure.parameter, above @ direction(closure.leaning(0.7))
    expected = closure.columns(above, wo).sum(0) * (n + 1) / (n + 2)
    np.testing.assert_allclose(closure.density(above, wo) * cos_i, expected, rtol=1e-9, atol=1e-12)


def visible_normals(kind, alpha, wo, count):
    """Normals (n, 3) that wo sees, n < count, drawn by rejection from a surface of alpha = 1.

    Stretching a surface by alpha keeps what is seen (Heitz and d'Eon 2014). With alpha = 1 the
    normals of GGX are those of a hemisphere, and the slopes of Beckmann are normally distributed.
    """
    rng = np.random.default_rng(0)
    seen_from = normalized(wo * [alpha, alpha, 1])
    if kind == "ggx":
        normals = normalized(rng.normal(size=(count, 3)))
        normals[:, 2] = np.abs(normals[:, 2])
        most = 1
    else:
        # all have the same area on the ground, hence the length 1 / cos
        normals = np.append(rng.normal(0, np.sqrt(0.5), (count, 2)), np.ones((count, 1)), 1)
        most = seen_from[2] + 5 * seen_from[0]
    normals = normals[rng.random(count) * most < normals @ seen_from]
    return normalized(normals * [alpha, alpha, 1])


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
@pytest.mark.parametrize("theta_o", VIEWS)
def test_density_of_microfacets_is_that_of_visible_normals(closure, theta_o):
    """Chi-square over cells of the half vector, and one for what is reflected below the horizon."""
    wo = direction(theta_o)

    def counts(h, weight):
        slope = np.hypot(h[:, 0], h[:, 1]) / h[:, 2] / closure.parameter
        ring = np.searchsorted([0.25, 0.5, 0.75, 1, 1.5, 2.5], slope)
        sector = (np.abs(np.arctan2(h[:, 1], h[:, 0])) / np.pi * 4).astype(int)
        return np.bincount(ring * 4 + sector, weight, 28)

    normals = visible_normals(closure.kind, closure.parameter, wo, 100_000)
    up = 2 * (normals @ wo) * normals[:, 2] - wo[2] > 0
    observed = np.append(counts(normals[up], None), (~up).sum())
    view = view_quadrature(theta_o, 1000, 16)
    shares = closure.density(view.wi, view.wo) * view.solid_angle
    assert shares.sum() < 1.001
    below = max(1 - shares.sum(), 0)
    expected = np.append(counts(normalized(view.wi + wo), shares), below) * len(normals)
    common = expected > 20
    chi_square = ((observed - expected)[common] ** 2 / expected[common]).sum()
    n = common.sum()
    assert n >= 5
    assert chi_square < n + 4 * np.sqrt(2 * n)


@pytest.mark.parametrize("closure", MICROFACETS, ids=str)
def test_density_of_microfacets_below_the_horizon(closure, around):
    for theta_o in VIEWS:
        density = closure.density(around, direction(theta_o))
        assert (density[around[:, 2] <= 0] == 0).all()
        assert (density >= 0).all()
        assert density.max() > 0


# ---- where a ramp leans ----


@pytest.mark.parametrize("degrees", [10, 45, 80])
@pytest.mark.parametrize(
    ("lean", "centre"),
    [
        (0, lambda theta: -theta),
        (0.5, lambda theta: 0),  # the mirror of the mirror direction at half the way
        (1.0, lambda theta: theta),
        (-0.3, lambda theta: -theta - 0.3 * (np.pi / 2 - theta)),
        (-1.0, lambda theta: -np.pi / 2),
    ],
)
def test_centre_of_a_leaning_ramp(degrees, lean, centre):
    """Where the directions are drawn most densely, as an angle towards the viewer."""
    theta = np.radians(degrees)
    closure = Closure("phong_ramp", 5000, lean=lean)
    angles = np.linspace(-np.pi / 2, np.pi / 2, 18001)[1:-1]
    wi = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], -1)
    found = angles[closure.density(wi, direction(theta)).argmax()]
    assert found == pytest.approx(centre(theta), abs=2e-4)


@pytest.mark.parametrize("lean", [-0.6, -0.3, 0.5, 1.0])
def test_tilt_at_the_ends(lean):
    closure = Closure("phong_ramp", 10, lean=lean)
    assert closure.leaning(0.0) == pytest.approx(0 if lean > 0 else lean * np.pi / 4)
    assert closure.leaning(np.pi / 2) == pytest.approx(lean * np.pi / 2 if lean > 0 else 0)


def test_no_lean_no_tilt():
    for closure in (Closure("phong_ramp", 10), Closure("diffuse_ramp"), Closure("ggx", 0.1)):
        assert closure.leaning(1.0) == 0


def test_text_gives_the_same_closures():
    some = (
        *CATALOGUE,
        Closure("ggx", 0.1, across=0.3, azimuth=1.2),
        Closure("phong_ramp", 3, tilt=0.3),
    )
    assert closures.loads(closures.dumps(some)) == some


@pytest.mark.parametrize(
    "text",
    [
        "no JSON",
        "3",
        "[3]",
        '[["ggx", 0.1, 0]]; import os',
        '[["glass", 0.1, 0, 0, 0, 0]]',
        '[["ggx", 0.0, 0, 0, 0, 0]]',
        '[["ggx", NaN, 0, 0, 0, 0]]',
        '[["ggx", 0.1, 0, 0, 0, Infinity]]',
        '[["ggx", 0.1, 0, 0, 0, 0, 0]]',
        '[["phong_ramp", 1e9, 0, 0, 0, 0]]',
        '[["phong_ramp", 1, 0, 0, "tilt", 0]]',
        '[["phong_ramp", 1, 0, 0, 2, 0]]',
    ],
)
def test_other_text_is_refused(text):
    with pytest.raises(ValueError):
        closures.loads(text)
