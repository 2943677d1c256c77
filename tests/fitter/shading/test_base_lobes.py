# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fitter.quadrature import view_quadrature
from fitter.shading import base_lobes
from fitter.shading.base_catalogue import CATALOGUE, catalogue, draft_closures
from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import N_CLOSURES, fit_base_lobes, select_closures
from fitter.shading.closures import Closure
from fitter.shading.view_grid import DRAFT_GRIDS, FIT_GRIDS
from tests.bases import base_of
from tests.models import ANISOTROPIC_MODELS, MODELS, make

VIEW_ANGLES = np.array(FIT_GRIDS["isotropic"].theta_o)


@dataclass(frozen=True)
class Planted:
    """Stands in for a FactorModel whose lobes are sums of closures, in the catalogue or not.

    lobes : for every lobe pairs of a closure and its numbers (3, columns)
    """

    lobes: tuple
    diffuse: np.ndarray
    kind: str = "isotropic"

    def lobe_values(self, wi, wo):
        value = np.zeros((len(self.lobes), len(wi), 3))
        for lobe, parts in zip(value, self.lobes, strict=True):
            for closure, numbers in parts:
                lobe += (numbers @ closure.columns(wi, wo[0])).T / wi[:, 2:]
        return value


def microfacet(kind, alpha, f0, f90):
    return [(Closure(kind, alpha), np.stack([f0, f90], 1).astype(float))]


PLANTED = Planted(
    (
        microfacet("ggx", 0.038, (0.04, 0.05, 0.06), (1, 1, 1)),
        microfacet("beckmann", 0.22, (0.3, 0.2, 0.1), (0.5, 0.5, 0.5)),
        microfacet("ggx", 0.62, (0.1, 0.2, 0.3), (0.2, 0.4, 0.6)),
    ),
    np.array([0.02, 0.03, 0.05]),
)
DICTIONARY = (
    Closure("ggx", 0.038),
    Closure("phong_ramp", 60, lean=-0.3),
    Closure("beckmann", 0.22),
    Closure("diffuse_ramp"),
    Closure("ggx", 0.62),
)

MIRROR = make((0, 0, 0), (0.9, 0.7, 0.4), (0.001, 0.003, 0.01), [[0.5] * 3, [0.3] * 3, [0.2] * 3])
ONE_LOBE = replace(MODELS["plastic"], scale=MODELS["plastic"].scale * [[0], [1], [0]])
BLACK = replace(MODELS["matte"], scale=np.zeros((3, 3)), diffuse=np.zeros(3))
EXTREMES = {
    "black": BLACK,
    "diffuse": replace(BLACK, diffuse=np.full(3, 0.3)),
    "one lobe": ONE_LOBE,
    "one channel": replace(ONE_LOBE, scale=ONE_LOBE.scale * [1, 0, 0]),
    "mirror": MIRROR,
    "no D": replace(ONE_LOBE, ndf=np.zeros((3, 90))),
    "faint": replace(ONE_LOBE, scale=ONE_LOBE.scale * 1e-12),
    "bright": replace(ONE_LOBE, scale=ONE_LOBE.scale * 1e3),
}


@pytest.fixture(params=MODELS)
def name(request):
    return request.param


def error(model, base, theta_o, tints=None):
    """Share of the light of the lobes by which the base is wrong at a view angle."""
    view = view_quadrature(theta_o, 110, 20)
    lobes = model.lobe_values(view.wi, np.broadcast_to(view.wo, view.wi.shape))
    if tints is not None:
        lobes = lobes * tints[:, None, :]
    exact = lobes.sum(0) * view.wi[:, 2:]
    difference = np.abs(base.value(view.wi, view.wo, tints) - exact)
    return (difference.sum(1) @ view.solid_angle) / (exact.sum(1) @ view.solid_angle)


# ---- what is found ----


def test_closures_of_the_dictionary_are_found_again():
    base = fit_base_lobes(PLANTED, DICTIONARY)
    assert base.closures == DICTIONARY
    assert base.weights.shape == (len(VIEW_ANGLES), 1, 3, 3, 2 + 8 + 2 + 8 + 2)
    for theta_o in VIEW_ANGLES[::2]:
        assert error(PLANTED, base, theta_o) < 2e-3
    # each lobe for itself, too
    oblique = base.theta_o > np.radians(62)  # further up F90 is not determined
    for lobe, first in enumerate((0, 10, 12 + 8)):
        (_, expected), *_ = PLANTED.lobes[lobe]
        found = base.weights[oblique][:, 0, lobe, :, first : first + 2]
        np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), rtol=0.1)
        tints = np.zeros((3, 3))
        tints[lobe] = 1
        for theta_o in VIEW_ANGLES[::4]:
            assert error(PLANTED, base, theta_o, tints) < 2e-2


def test_closures_of_a_material_are_selected():
    """With numbers of closures in it, a material is told from the catalogue's other entries."""
    one = Planted((microfacet("ggx", 0.11, (0.5,) * 3, (1,) * 3),), np.zeros(3))
    assert select_closures(one, 1) == (Closure("ggx", 0.11),)
    ramp = Planted(([(Closure("phong_ramp", 40, 0.5), np.full((3, 8), 0.2))],), np.zeros(3))
    assert select_closures(ramp, 1) == (Closure("phong_ramp", 40, 0.5),)
    base = fit_base_lobes(PLANTED)
    for theta_o in VIEW_ANGLES[:-2:2]:
        assert error(PLANTED, base, theta_o) < 1e-2


def test_selection(bases, name):
    closures = bases[name].closures
    assert len(set(closures)) == len(closures) == N_CLOSURES
    assert set(closures) <= set(CATALOGUE)
    # forward selection: fewer are the first of more
    assert select_closures(MODELS[name], 3) == closures[:3]


def test_catalogue_has_no_entry_twice():
    assert len(set(CATALOGUE)) == len(CATALOGUE)


def test_microfacet_weights_are_never_negative(bases, name):
    base = bases[name]
    column = 0
    some_negative = False
    for closure in base.closures:
        weights = base.weights[..., column : column + closure.n_columns]
        if closure.kind in ("ggx", "beckmann"):
            assert (weights >= 0).all()
        else:
            some_negative |= (weights < 0).any()
        column += closure.n_columns
    assert column == base.weights.shape[-1]
    # ramps make use of their freedom
    assert some_negative


# Per cent of the light of the lobes: the largest error up to 60 degrees, and up to 81.
ERRORS = {
    "matte": (0.6, 1.3),
    "plastic": (0.8, 0.8),
    "metal": (1.5, 2.0),
    "paint": (0.6, 1.0),
    "velvet": (0.7, 1.5),
}


@pytest.fixture(scope="module")
def errors_at_nodes(bases):
    return {
        name: np.array([error(MODELS[name], base, theta) for theta in base.theta_o])
        for name, base in bases.items()
    }


def test_error_is_small(errors_at_nodes, name):
    errors, degrees = 100 * errors_at_nodes[name], np.degrees(VIEW_ANGLES)
    upright, oblique = ERRORS[name]
    assert errors[degrees < 61].max() < upright
    assert errors[degrees < 82].max() < oblique
    assert errors[degrees < 87].max() < 4
    # next to nothing is reflected towards the horizon
    assert errors.max() < 8


def test_error_between_the_nodes_is_that_at_the_nodes(bases, errors_at_nodes, name):
    at_nodes = errors_at_nodes[name]
    middles = (VIEW_ANGLES[1:] + VIEW_ANGLES[:-1]) / 2
    between = np.array([error(MODELS[name], bases[name], theta) for theta in middles])
    larger = np.maximum(at_nodes[1:], at_nodes[:-1])
    # in the last interval everything falls to 0 at the horizon, and not linearly
    assert (between[:-1] < 1.6 * larger[:-1]).all()
    assert between[-1] < 3 * larger[-1]


def test_error_of_scaled_lobes(bases, name):
    """An artist scales single lobes: the base of the untouched material still holds."""
    tints = np.array([[0.5, 0.5, 0.5], [0.0, 0.0, 0.0], [3.0, 1.0, 0.2]])
    angles = np.radians([5, 30, 50, 65])
    errors = [error(MODELS[name], bases[name], theta, tints) for theta in angles]
    # single lobes are followed less closely than their sum
    assert max(errors) < {"metal": 0.06, "paint": 0.08}.get(name, 0.025)


# ---- value ----


@pytest.fixture
def directions():
    rng = np.random.default_rng(1)
    wi = rng.normal(size=(500, 3))
    wi[:, 2] = np.abs(wi[:, 2])
    return wi / np.linalg.norm(wi, axis=1)[:, None]


WO = np.array([np.sin(0.8), 0, np.cos(0.8)])


def test_value_is_linear_in_the_tints(bases, directions):
    base = bases["paint"]
    first, second = np.random.default_rng(2).random((2, 3, 3))
    found = base.value(directions, WO, first) + 2 * base.value(directions, WO, second)
    expected = base.value(directions, WO, first + 2 * second)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    ones = base.value(directions, WO, np.ones((3, 3)))
    np.testing.assert_allclose(base.value(directions, WO), ones, rtol=1e-12)
    assert not base.value(directions, WO, np.zeros((3, 3))).any()


def test_tints_are_per_lobe_and_channel(bases, directions):
    base = bases["plastic"]
    for lobe, channel in np.ndindex(3, 3):
        tints = np.zeros((3, 3))
        tints[lobe, channel] = 1
        alone = replace(base, weights=base.weights * tints[:, :, None])
        value = base.value(directions, WO, tints)
        np.testing.assert_allclose(value, alone.value(directions, WO), rtol=1e-12)
        others = [c for c in range(3) if c != channel]
        assert not value[:, others].any()
        assert value[:, channel].any()


def test_scaling_a_model_scales_its_weights(bases):
    model, base = MODELS["velvet"], bases["velvet"]
    # all lobes and the diffuse part: what is relative stays as it is
    scaled = replace(model, scale=3 * model.scale, diffuse=3 * model.diffuse)
    found = fit_base_lobes(scaled, base.closures)
    atol = 1e-9 * np.abs(base.weights).max()
    np.testing.assert_allclose(found.weights, 3 * base.weights, rtol=1e-6, atol=atol)
    np.testing.assert_allclose(found.picking, 3 * base.picking, rtol=1e-6, atol=atol)


def test_value_between_the_nodes_is_linear_in_the_angle(bases):
    base = bases["metal"]
    nodes = base.weights[:, 0]
    largest = np.abs(nodes).max()

    def found(theta):
        return base.weights_at(np.array([np.sin(theta), 0, np.cos(theta)])) / largest

    left, right = VIEW_ANGLES[10], VIEW_ANGLES[11]
    np.testing.assert_allclose(found(left), nodes[10] / largest, atol=1e-12)
    np.testing.assert_allclose(found(right), nodes[11] / largest, atol=1e-12)
    expected = 0.7 * nodes[10] + 0.3 * nodes[11]
    np.testing.assert_allclose(found(0.7 * left + 0.3 * right), expected / largest, atol=1e-12)
    # constant beyond the first and the last
    np.testing.assert_allclose(found(0.0), nodes[0] / largest, atol=1e-12)
    np.testing.assert_allclose(found(np.pi / 2), nodes[-1] / largest, atol=1e-12)


def test_value_is_that_of_the_closures(bases, directions):
    base = bases["matte"]
    weights = base.weights_at(WO).sum(0)
    expected, column = np.zeros((len(directions), 3)), 0
    for closure in base.closures:
        for row in closure.columns(directions, WO):
            expected += row[:, None] * weights[:, column]
            column += 1
    np.testing.assert_allclose(base.value(directions, WO), expected, rtol=1e-9, atol=1e-12)


def test_value_below_the_horizon_is_black(bases, directions):
    for base in bases.values():
        assert not base.value(directions * [1, 1, -1], WO).any()


# ---- what a fit costs and leaves alone ----


def test_given_closures_save_the_selection(bases, monkeypatch):
    monkeypatch.delattr(base_lobes, "select_closures")
    base = bases["plastic"]
    again = fit_base_lobes(MODELS["plastic"], base.closures)
    assert again.closures == base.closures
    np.testing.assert_array_equal(again.weights, base.weights)
    np.testing.assert_array_equal(again.picking, base.picking)
    # after an edit the dictionary is still good
    edited = replace(MODELS["plastic"], ndf=MODELS["plastic"].ndf ** 0.9)
    fresh = fit_base_lobes(edited, list(base.closures))
    assert fresh.closures == base.closures
    assert error(edited, fresh, np.radians(35)) < 0.02


def test_dictionaries_are_computed_once(bases, monkeypatch):
    calls = []
    columns = Closure.columns
    monkeypatch.setattr(Closure, "columns", lambda *a: calls.append(1) or columns(*a))
    closures = (Closure("ggx", 0.123), Closure("phong_ramp", 5))
    fit_base_lobes(MODELS["metal"], closures)
    assert len(calls) == 2 * len(VIEW_ANGLES)
    fit_base_lobes(MODELS["matte"], closures)
    assert len(calls) == 2 * len(VIEW_ANGLES)


def test_same_model_gives_the_same_base(bases):
    again = fit_base_lobes(MODELS["velvet"])
    assert again.closures == bases["velvet"].closures
    np.testing.assert_array_equal(again.weights, bases["velvet"].weights)
    np.testing.assert_array_equal(again.picking, bases["velvet"].picking)


# ---- picking ----


def test_picking_is_for_ramps_alone(bases, name):
    base = bases[name]
    assert base.picking.shape == (len(VIEW_ANGLES), 1, 3, N_CLOSURES)
    ramp = np.array([closure.signed for closure in base.closures])
    assert (base.picking >= 0).all()
    assert not base.picking[..., ~ramp].any()
    assert base.picking[..., ramp].any()
    # a share of light
    assert base.picking.sum((2, 3)).max() < 1


def test_picking_without_ramps_is_zero():
    base = fit_base_lobes(MODELS["matte"], [Closure("ggx", 0.3), Closure("beckmann", 0.5)])
    assert base.picking.shape == (len(VIEW_ANGLES), 1, 3, 2)
    assert not base.picking.any()


def test_picking_is_the_albedo_of_what_follows_the_density():
    """A lobe that is as much light as 0.3 of the density of a ramp."""
    ramp, other = Closure("phong_ramp", 40), Closure("phong_ramp", 4, 1.0)

    @dataclass(frozen=True)
    class Proportional:
        diffuse: np.ndarray
        kind: str = "isotropic"

        def lobe_values(self, wi, wo):
            grey = 0.3 * ramp.density(wi, wo[0]) / wi[:, 2]
            return grey[None, :, None] * [0.5, 1.0, 1.5]

    base = fit_base_lobes(Proportional(np.zeros(3)), [other, ramp])
    np.testing.assert_allclose(base.picking[:, 0, 0, 1], 0.3, rtol=2e-2)
    np.testing.assert_allclose(base.picking[:, 0, 0, 0], 0, atol=1e-2)


def test_what_microfacets_cover_is_not_picked_by_ramps():
    one = Planted((microfacet("ggx", 0.3, (0.5,) * 3, (1,) * 3),), np.zeros(3))
    base = fit_base_lobes(one, [Closure("ggx", 0.3), Closure("phong_ramp", 12)])
    assert base.picking.max() < 0.01


# ---- the ends ----


def test_nothing_leans_away_where_there_is_no_direction_to_lean(bases):
    closures = (Closure("ggx", 0.2), Closure("phong_ramp", 12, lean=-0.6))
    base = fit_base_lobes(MODELS["velvet"], closures)
    assert not base.weights[0, ..., 2:].any()
    assert base.weights[1, ..., 2:].any()


def test_diffuse_ramps_have_no_colour_at_the_horizon(bases):
    """Cycles draws directions by the cosine: a colour where it is 0 has no finite variance."""
    closures = (Closure("ggx", 0.2), Closure("diffuse_ramp"), Closure("phong_ramp", 3))
    base = fit_base_lobes(MODELS["velvet"], closures)
    assert not base.weights[..., 2].any()
    assert (np.abs(base.weights[5]).max((0, 1, 2))[3:] > 0).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("extreme", EXTREMES)
def test_extreme_models_are_finite(extreme, directions):
    model = EXTREMES[extreme]
    base = fit_base_lobes(model)
    assert len(set(base.closures)) == N_CLOSURES
    for numbers in (base.weights, base.picking, base.value(directions, WO)):
        assert np.isfinite(numbers).all()
    if not model.lobe_values(directions, np.broadcast_to(WO, directions.shape)).any():
        assert not base.weights.any()
        assert not base.picking.any()
    elif extreme != "mirror":
        assert error(model, base, 0.8) < 0.02


def test_lobes_and_channels_without_light_have_no_weights():
    base = fit_base_lobes(EXTREMES["one channel"])
    dark = np.ones((3, 3), bool)
    dark[1, 0] = False
    assert np.abs(base.weights[:, 0, dark]).max() < 1e-6 * np.abs(base.weights).max()


# ---- materials with a direction ----

BRUSHED = ANISOTROPIC_MODELS["brushed"]


@pytest.fixture(scope="module")
def directed():
    return {name: base_of(name) for name in ANISOTROPIC_MODELS}


def directed_error(model, base, theta_o, phi_o, tints=None):
    """As error, for a view from an azimuth."""
    view = view_quadrature(theta_o, 60, 70, 2 * np.pi).turned(phi_o)
    lobes = model.lobe_values(view.wi, np.broadcast_to(view.wo, view.wi.shape))
    if tints is not None:
        lobes = lobes * tints[:, None, :]
    exact = lobes.sum(0) * view.wi[:, 2:]
    difference = np.abs(base.value(view.wi, view.wo, tints) - exact)
    return (difference.sum(1) @ view.solid_angle) / (exact.sum(1) @ view.solid_angle)


# Between the nodes of the table, degrees.
BETWEEN = [(4, 10), (20, 97), (41, 187), (57, 293), (71, 350)]


@pytest.mark.parametrize("name", ANISOTROPIC_MODELS)
def test_error_of_directed_models(directed, name):
    model, base = ANISOTROPIC_MODELS[name], directed[name]
    grid = FIT_GRIDS["anisotropic"]
    columns = sum(c.n_columns for c in base.closures)
    assert base.weights.shape == (len(grid.theta_o), grid.n_phi, 3, 3, columns)
    errors = [directed_error(model, base, *np.radians(view)) for view in BETWEEN]
    assert max(errors) < 0.1
    assert np.mean(errors) < 0.06
    tints = np.array([[0.5, 0.5, 0.5], [0.0, 0.0, 0.0], [3.0, 1.0, 0.2]])
    assert directed_error(model, base, *np.radians(BETWEEN[2]), tints) < 0.15


def test_directed_closures_are_found_again():
    """A lobe about a tangent of its own, and a ramp about a normal of its own."""
    lobe = Closure("ggx", 0.15, across=0.4, azimuth=0.6)
    ramp = Closure("phong_ramp", 12, tilt=0.3, azimuth=-1.0)
    numbers = np.full((3, 8), 0.1)
    model = Planted(
        (microfacet("ggx", 0.6, (0.2,) * 3, (0.3,) * 3), [(lobe, np.full((3, 2), 0.4))]),
        np.zeros(3),
        kind="anisotropic",
    )
    model = replace(model, lobes=(*model.lobes, [(ramp, numbers)]))
    base = fit_base_lobes(model, (Closure("ggx", 0.6), lobe, ramp))
    for view in BETWEEN[1:]:
        assert directed_error(model, base, *np.radians(view)) < 5e-3
    upright = base.weights[4:9]
    np.testing.assert_allclose(upright[..., 1, :, 2:3], 0.4, rtol=0.05)
    np.testing.assert_allclose(upright[..., 2, :, 6:], 0.1, rtol=0.1)


def test_catalogue_turns_with_the_material():
    """What has a direction has it from the material; at right angles the table is its own."""
    quarter = 12
    turned = replace(
        BRUSHED,
        ndf=np.roll(BRUSHED.ndf, quarter, axis=2),
        masking=np.roll(BRUSHED.masking, quarter, axis=2),
    )
    before, after = catalogue(BRUSHED), catalogue(turned)
    assert len(set(before)) == len(before) == len(after)
    for one, other in zip(before, after, strict=True):
        assert (one.kind, one.parameter, one.lean, one.across, one.tilt) == (
            other.kind,
            other.parameter,
            other.lean,
            other.across,
            other.tilt,
        )
        directed = one.across or one.tilt
        turn = (other.azimuth - one.azimuth) % np.pi if directed else np.pi / 2
        assert turn == pytest.approx(np.pi / 2, abs=1e-9)


def test_base_turns_with_the_material(directed):
    quarter = 12
    turned = replace(
        BRUSHED,
        ndf=np.roll(BRUSHED.ndf, quarter, axis=2),
        masking=np.roll(BRUSHED.masking, quarter, axis=2),
    )
    base = directed["brushed"]
    closures = [
        replace(c, azimuth=c.azimuth + np.pi / 2) if c.across or c.tilt else c
        for c in base.closures
    ]
    found = fit_base_lobes(turned, closures).weights
    expected = np.roll(base.weights, 6, axis=1)
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_azimuths_are_periodic(directed):
    base = directed["satin"]

    def weights_at(phi):
        wo = np.array([np.sin(0.7) * np.cos(phi), np.sin(0.7) * np.sin(phi), np.cos(0.7)])
        return base.weights_at(wo)

    step = 2 * np.pi / base.weights.shape[1]
    middle = weights_at(-step / 2)
    np.testing.assert_allclose(middle, (weights_at(-step) + weights_at(0)) / 2, atol=1e-12)
    np.testing.assert_allclose(weights_at(0.3), weights_at(0.3 - 2 * np.pi), atol=1e-12)


def test_draft_has_fewer_views(directed):
    base = directed["brushed"]
    draft = fit_base_lobes(BRUSHED, base.closures, draft=True)
    assert draft.closures == base.closures
    assert draft.weights.shape[:2] == (len(DRAFT_GRIDS["anisotropic"].theta_o), 8)
    assert directed_error(BRUSHED, draft, *np.radians(BETWEEN[2])) < 0.12
    # those of isotropic materials are few as they are
    plain = fit_base_lobes(MODELS["matte"], (Closure("ggx", 0.3),), draft=True)
    assert len(plain.theta_o) == len(VIEW_ANGLES)


def test_draft_needs_no_selection(monkeypatch):
    monkeypatch.setattr(base_lobes, "select_closures", None)
    for degrees in (0, 50):
        shift = round(degrees / 7.5)
        turned = {
            name: np.roll(getattr(BRUSHED, name), shift, axis=2) for name in ("ndf", "masking")
        }
        model = replace(BRUSHED, **turned)
        draft = fit_base_lobes(model, draft=True)
        assert draft.closures == draft_closures(model)
        assert len(draft.closures) == N_CLOSURES
        assert base_error(model, draft).image < 0.05
    assert draft_closures(MODELS["matte"]) == ()  # theirs are selected in no time


@pytest.mark.filterwarnings("error")
def test_black_directed_model_is_finite(directions):
    black = replace(BRUSHED, scale=np.zeros((3, 3)), diffuse=np.zeros(3))
    base = fit_base_lobes(black, (Closure("ggx", 0.1, across=0.3), Closure("phong_ramp", 3)))
    assert not base.weights.any()
    assert not base.value(directions, WO).any()
