# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import fields, replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import albedo as anisotropic_albedo
from fitter.editing import curves, edits
from fitter.editing.edits import RANGES, Edits, LobeSliders, Sliders
from fitter.editing.energy import within_energy
from fitter.geometry import theta_d_centres
from fitter.models.anisotropic_tables import anisotropic_sampling
from fitter.models.anisotropy import anisotropy
from fitter.models.model import FactorModel
from fitter.models.tables import directional_albedo, lobe_albedo, sampling_tables
from tests.models import ANISOTROPIC_MODELS, MODELS

ALL = MODELS | ANISOTROPIC_MODELS
FACTORS = [field.name for field in fields(FactorModel)]


def assert_same(one, two):
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), name)


def with_lobe(lobe=0, **values):
    lobes = list(Sliders().lobes)
    lobes[lobe] = LobeSliders(**values)
    return Edits(sliders=Sliders(lobes=tuple(lobes)))


def bent(model, name, change):
    """The model with one curve's heights changed."""
    before = edits.drawn(model)
    return edits.apply(model, Edits(before, {**before, name: change(before[name].copy())}))


def directions(n=400, seed=1):
    rng = np.random.default_rng(seed)
    z = rng.uniform(0.02, 1, (2, n))
    phi = rng.uniform(0, 2 * np.pi, (2, n))
    ring = np.sqrt(1 - z**2)
    return np.stack([ring * np.cos(phi), ring * np.sin(phi), z], -1)


# ---- neutral ----


@pytest.mark.parametrize("model", ALL.values(), ids=ALL)
def test_untouched_material_keeps_every_bit(model):
    assert_same(edits.apply(model, Edits()), model)
    drawn = edits.drawn(model)
    again = {name: heights.copy() for name, heights in drawn.items()}
    assert_same(edits.apply(model, Edits(drawn, again)), model)
    # a curve that is not in both changes nothing
    assert_same(edits.apply(model, Edits({}, {"F": np.zeros(90)})), model)


def test_what_is_not_touched_keeps_every_bit():
    model = MODELS["paint"]

    def lower_tail(heights):
        heights[60:] *= 0.9
        return heights

    changed = bent(model, "Lobe 2 D", lower_tail)
    np.testing.assert_array_equal(changed.ndf[[0, 2]], model.ndf[[0, 2]])
    np.testing.assert_array_equal(changed.ndf[1, :60], model.ndf[1, :60])
    assert (changed.ndf[1, 60:] < model.ndf[1, 60:]).all()
    for factor in ("diffuse", "scale", "masking", "fresnel"):
        np.testing.assert_array_equal(getattr(changed, factor), getattr(model, factor))


# ---- curves ----


def test_a_lower_curve_of_one_channel_darkens_that_channel():
    changed = bent(MODELS["plastic"], "F Green", lambda heights: heights / 2)
    np.testing.assert_allclose(changed.fresnel[1], MODELS["plastic"].fresnel[1] / 2)
    np.testing.assert_array_equal(changed.fresnel[[0, 2]], MODELS["plastic"].fresnel[[0, 2]])


def test_the_common_curve_moves_all_channels():
    changed = bent(MODELS["metal"], "F", lambda heights: heights * 0.7)
    np.testing.assert_allclose(changed.fresnel, 0.7 * MODELS["metal"].fresnel)


def test_masking_at_the_horizon_is_not_for_editing():
    changed = bent(MODELS["matte"], "Lobe 1 G", lambda heights: np.ones_like(heights))
    assert changed.masking[0, -1] == MODELS["matte"].masking[0, -1]
    assert changed.masking[0, :-1] == pytest.approx(1)


def test_flat_zero_is_black_where_the_axis_is_linear():
    black = bent(MODELS["metal"], "F", np.zeros_like)
    assert not black.fresnel.any()
    dark = bent(MODELS["metal"], "Lobe 1 G", np.zeros_like)
    assert not dark.masking[0].any()


def wild_curves(rng):
    """Heights as a person, or a program, may draw them."""
    kinds = ("zero", "one", "spikes", "noise", "outside", "infinite", "step")
    heights = {}
    for name in curves.CURVES:
        kind = rng.choice(kinds)
        line = rng.random(90)
        if kind == "zero":
            line[:] = 0
        elif kind == "one":
            line[:] = 1
        elif kind == "spikes":
            line = np.where(rng.random(90) < 0.05, 1.0, 0.0)
        elif kind == "outside":
            line = rng.normal(0, 50, 90)
        elif kind == "infinite":
            line[rng.integers(90, size=5)] = rng.choice([np.nan, np.inf, -np.inf], 5)
        elif kind == "step":
            line = (np.arange(90) > rng.integers(90)).astype(float)
        heights[name] = line
    return heights


def wild_sliders(rng):
    def value(name):
        low, high = RANGES[name]
        return float(rng.choice([low, high, rng.uniform(low, high)]))

    lobes = tuple(
        LobeSliders(*(value(item.name) for item in fields(LobeSliders))) for _ in range(3)
    )
    tint = tuple(float(c) for c in rng.integers(0, 2, 3))
    names = [item.name for item in fields(Sliders) if item.name not in ("lobes", "edge_tint")]
    return Sliders(lobes=lobes, edge_tint=tint, **{name: value(name) for name in names})


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", range(64))
def test_any_edit_is_a_reciprocal_model_of_finite_numbers(seed):
    rng = np.random.default_rng(seed)
    model = list(ALL.values())[seed % len(ALL)]
    before = edits.drawn(model) if seed % 3 else wild_curves(rng)
    changed = edits.apply(model, Edits(before, wild_curves(rng), wild_sliders(rng)))
    for factor in FACTORS:
        values = getattr(changed, factor)
        assert values.shape == getattr(model, factor).shape
        assert np.isfinite(values).all()
        assert (values >= 0).all()
    one, two = directions()
    values = changed.f_r(one, two)
    assert np.isfinite(values).all()
    assert (values >= 0).all()
    np.testing.assert_array_equal(values, changed.f_r(two, one))
    anisotropic = model.kind == "anisotropic"
    tables = anisotropic_sampling(changed) if anisotropic else sampling_tables(changed)
    assert np.isfinite(tables.density).all()
    assert tables.cumulative[:, -1] == pytest.approx(1)
    if anisotropic:  # or a parameter file would be refused
        for table in (changed.ndf, changed.masking):
            np.testing.assert_allclose(table[:, 0], table[:, 0, :1].repeat(48, 1), rtol=1e-7)


def fine_albedo(model):
    """By an integral that follows spikes: 24 views."""
    theta = np.random.default_rng(0).uniform(0, np.radians(87), 24)
    if model.kind == "isotropic":
        return directional_albedo(model, theta)
    wo = polar_grid.unit_vectors(theta, np.linspace(0, 6, 24))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(anisotropic_albedo, "N_THETA_H", 96)
        patch.setattr(anisotropic_albedo, "N_PHI_H", 192)
        return anisotropic_albedo.directional_albedo(model, wo)


@pytest.mark.parametrize("seed", range(len(ALL)))
def test_any_edit_can_be_brought_within_energy(seed):
    rng = np.random.default_rng(seed)
    model = list(ALL.values())[seed]
    # as a widget clips them: no integral of a few points follows spikes over fifty decades
    drawable = {n: np.clip(np.nan_to_num(row), 0, 1) for n, row in wild_curves(rng).items()}
    changed = edits.apply(model, Edits(edits.drawn(model), drawable, wild_sliders(rng)))
    # not all of it black, which nothing exceeds
    brighter = replace(changed, scale=100 * changed.scale, fresnel=changed.fresnel + 0.1)
    brighter = replace(brighter, ndf=changed.ndf + 0.1, masking=changed.masking + 0.1)
    assert fine_albedo(brighter).max() > 1
    assert fine_albedo(within_energy(brighter)).max() <= 1.03


# ---- sliders ----


@pytest.mark.parametrize("name", MODELS)
def test_width_stretches_and_keeps_the_light(name):
    model = MODELS[name]
    for width in (0.5, 2.0):
        changed = edits.apply(model, with_lobe(1, width=width))
        wider = changed.ndf_width()[1] > model.ndf_width()[1]
        assert wider == (width > 1)
        np.testing.assert_array_equal(changed.ndf[[0, 2]], model.ndf[[0, 2]])
    narrow = MODELS["metal"]
    changed = edits.apply(narrow, with_lobe(1, width=2.0))
    before, after = (lobe_albedo(m, np.radians([0.0, 30]))[:, 1] for m in (narrow, changed))
    np.testing.assert_allclose(after, before, rtol=0.05)


def test_width_of_ggx_is_its_roughness():
    from tests.models import ggx

    base = MODELS["metal"]
    model = replace(base, ndf=np.stack([ggx(0.05), base.ndf[1], base.ndf[2]])).normalized()
    stretched = edits.apply(model, with_lobe(0, width=2.0)).ndf[0]
    expected = ggx(0.1) / ggx(0.1).max()
    np.testing.assert_allclose(stretched / stretched.max(), expected, rtol=0.02)


def test_haze_moves_light_from_the_peak_to_the_tail():
    model = MODELS["metal"]
    changed = edits.apply(model, with_lobe(0, haze=0.3))
    assert changed.ndf[0, 0] < model.ndf[0, 0]
    assert (changed.ndf[0, 30:] > model.ndf[0, 30:]).all()
    before, after = (lobe_albedo(m, np.array([0.1]))[0, 0] for m in (model, changed))
    np.testing.assert_allclose(after, before, rtol=0.05)


def test_falloff_is_a_power_of_masking():
    model = MODELS["plastic"]
    changed = edits.apply(model, with_lobe(2, falloff=2.0))
    np.testing.assert_allclose(changed.masking[2], model.masking[2] ** 2, atol=1e-12)
    held = edits.apply(model, with_lobe(2, falloff=0.0))
    np.testing.assert_array_equal(held.masking[2, :-1], 1)
    assert held.masking[2, -1] == model.masking[2, -1]


def test_gain_and_diffuse_color_leave_the_model():
    sliders = Sliders(
        lobes=(LobeSliders(gain=3),) * 3, diffuse_saturation=0.2, diffuse_hue=1.0, edge_strength=2.0
    )
    model = MODELS["paint"]
    assert sliders.for_model() == Sliders(edge_strength=2.0)
    assert_same(
        edits.apply(model, Edits(sliders=sliders)),
        edits.apply(model, Edits(sliders=sliders.for_model())),
    )


def test_edge_grows_towards_grazing():
    model = MODELS["plastic"]
    changed = edits.apply(
        model, Edits(sliders=Sliders(edge_strength=2.0, edge_tint=(1.0, 0.5, 0.25)))
    )
    ratio = changed.fresnel / model.fresnel
    theta = np.degrees(theta_d_centres())
    assert ratio[:, theta < 20] == pytest.approx(1, abs=0.01)
    np.testing.assert_allclose(ratio[:, -1], [2, 1, 0.5], rtol=0.03)
    assert (np.diff(ratio[0]) > 0).all()


def test_specular_without_saturation_is_grey():
    model = MODELS["metal"]
    grey = edits.apply(model, Edits(sliders=Sliders(specular_saturation=0.0)))
    values = grey.f_r(*directions())
    np.testing.assert_allclose(values, values[:, :1].repeat(3, 1), rtol=1e-9)
    # as bright as it was
    before = model.f_r(*directions())
    np.testing.assert_allclose(values @ edits.LUMINANCE, before @ edits.LUMINANCE, rtol=1e-9)


def test_specular_hue_turns_the_color():
    model = MODELS["metal"]
    turned = edits.apply(model, Edits(sliders=Sliders(specular_hue=2 * np.pi / 3)))
    before, after = model.f_r(*directions()), turned.f_r(*directions())
    # by a third of the circle: red becomes green
    np.testing.assert_allclose(after, np.roll(before, 1, axis=1), rtol=1e-9)


def test_color_matrix():
    np.testing.assert_array_equal(edits.color_matrix(1.0, 0.0), np.eye(3))
    for saturation, hue in ((0.3, 0.0), (1.0, 2.0), (2.0, -1.0)):
        np.testing.assert_allclose(edits.color_matrix(saturation, hue) @ np.ones(3), 1)
    assert edits.color_matrix(0.0, 0.0) @ [1, 0, 0] == pytest.approx(0.2126)


def test_a_lobe_without_light_stays_finite():
    model = MODELS["metal"]
    scale = model.scale.copy()
    scale[:, 2] = 0
    dark = replace(model, scale=scale, ndf=model.ndf * [[1], [0], [1]])
    for sliders in (Sliders(specular_saturation=0.5), Sliders(specular_hue=1.0)):
        assert np.isfinite(edits.apply(dark, Edits(sliders=sliders)).f_r(*directions())).all()
    changed = edits.apply(dark, with_lobe(1, width=3.0, haze=0.5))
    np.testing.assert_array_equal(changed.ndf[1], 0)


# ---- anisotropic ----


def test_directions_mean_nothing_to_an_isotropic_lobe():
    model = MODELS["metal"]
    assert_same(edits.apply(model, with_lobe(width_along=3.0, width_across=0.5)), model)


def test_widths_of_an_anisotropic_lobe_go_together_or_apart():
    model = ANISOTROPIC_MODELS["brushed"]
    both = edits.apply(model, with_lobe(1, width=1.5))
    apart = edits.apply(model, with_lobe(1, width_along=1.5, width_across=1.5))
    np.testing.assert_allclose(both.ndf, apart.ndf, rtol=1e-12)
    assert both.ndf_width()[1] > model.ndf_width()[1]
    across = edits.apply(model, with_lobe(0, width_across=2.0))
    assert anisotropy(across).strength > anisotropy(model).strength
    along = edits.apply(model, with_lobe(0, width_along=2.0))
    assert anisotropy(along).strength < anisotropy(model).strength
    np.testing.assert_array_equal(across.ndf[1:], model.ndf[1:])


def test_sliders_of_an_anisotropic_lobe():
    model = ANISOTROPIC_MODELS["satin"]
    hazy = edits.apply(model, with_lobe(0, haze=0.5))
    assert (hazy.ndf[0, 0] < model.ndf[0, 0]).all()
    assert (hazy.ndf[0, -1] > model.ndf[0, -1]).all()
    faded = edits.apply(model, with_lobe(0, falloff=2.0))
    np.testing.assert_allclose(faded.masking[0], model.masking[0] ** 2)
    brighter = edits.apply(model, Edits(sliders=Sliders(edge_strength=2.0)))
    assert (brighter.fresnel[:, 1:] > model.fresnel[:, 1:]).all()
    np.testing.assert_array_equal(brighter.ndf, model.ndf)
