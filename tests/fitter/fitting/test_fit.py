# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fitter import geometry, synthetic
from fitter.fitting import fit, joint, limits, prior, quality
from fitter.fitting.appearance import AppearanceError
from fitter.fitting.problem import Problem
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.grading import metrics, readability
from fitter.models import splines, tables
from fitter.pictures import sphere

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


def stages(steps):
    """Objectives of each stage, in order."""
    found = {}
    for step in steps:
        found.setdefault(step.stage, []).append(step.objective)
    return found


def table_psnr(table, measurement):
    """PSNR in dB of (f cos_i cos_o)^(1/2.2) over valid bins by measure; mean 0.3, peak 1."""
    bins = geometry.merl_bins()
    valid = measurement.valid
    cosines = np.where(valid, bins.cos_i * bins.cos_o, 0)[..., None]
    weight = np.where(valid, geometry.merl_solid_angle()[:, :, None], 0)[..., None] / 3
    weight = weight / (3 * weight.sum())
    value, reference = table * cosines, measurement.f_r * cosines
    exposure = 0.3 / (reference * weight).sum()
    shown, expected = (np.clip(x * exposure, 0, 1) ** (1 / 2.2) for x in (value, reference))
    return -10 * np.log10((weight * (shown - expected) ** 2).sum())


def lamps():
    """An environment (64, 128, 3): a sky that darkens downwards and a few bright soft lamps."""
    theta = ((np.arange(64) + 0.5) / 64 * np.pi)[:, None]
    phi = (np.arange(128) + 0.5) / 128 * 2 * np.pi
    sky = 0.3 + 0.7 * (1 + np.cos(theta)) / 2
    image = np.repeat(sky[:, :, None], 128, axis=1) * np.array([0.6, 0.8, 1.0])
    for at_theta, at_phi, width, color in (
        (0.9, 1.6, 0.12, (40, 36, 30)),
        (1.3, 4.5, 0.20, (10, 14, 20)),
        (0.5, 0.3, 0.30, (8, 8, 6)),
        (1.2, 2.6, 0.08, (60, 50, 40)),
    ):
        cos = np.cos(theta) * np.cos(at_theta) + np.sin(theta) * np.sin(at_theta) * np.cos(
            phi - at_phi
        )
        image += np.exp((cos - 1) / (width**2 / 2))[..., None] * np.array(color)
    return image


@pytest.mark.one_version
@pytest.mark.parametrize("fixture", ["two_lobe_steps", "planted_steps"])
def test_objective_never_rises_within_a_stage(request, fixture):
    found = stages(request.getfixturevalue(fixture))
    starts = range(1, quality.QUALITIES["standard"].starts + 1)
    explored = [f"{stage} {n}" for n in starts for stage in ("sweep", "explore")]
    work = quality.QUALITIES["standard"]
    finals = [stage for stage in found if stage.startswith("final")]
    assert len(finals) == work.finalists
    assert list(found) == [*explored, *finals, "refine", "appearance", "polish"]
    for stage, objectives in found.items():
        assert len(objectives) > 1, stage
        if stage.startswith("sweep"):
            continue  # putting factors in order may raise it
        for before, after in pairwise(objectives):
            assert after <= before * (1 + 1e-12), stage
    # the finalists are the best, and refining continues the best of them, on the same samples
    ranked = sorted(starts, key=lambda n: found[f"explore {n}"][-1])
    assert finals == [f"final {n}" for n in ranked[: work.finalists]]
    for stage in finals:
        assert found[stage][0] <= found[stage.replace("final", "explore")][-1]
    best = min(found[stage][-1] for stage in finals)
    assert found["refine"][0] <= best * (1 + 1e-12)
    assert found["refine"][-1] < best


@pytest.mark.one_version
def test_without_the_prior_no_step_at_all_raises_the_objective(two_lobes, monkeypatch):
    work = replace(
        quality.QUALITIES["draft"], starts=2, sweeps=5, explore_steps=3, refine_steps=16,
        polish_steps=2,
    )  # fmt: skip
    monkeypatch.setitem(quality.QUALITIES, "draft", work)
    steps = list(fit.fit_steps(two_lobes, quality="draft", prior_strength=0))
    found = stages(steps)
    assert len(found["refine"]) > fit.REFINE_JOINT_STEPS  # a sweep between joint steps
    found.pop("limit", None)  # free factors may end too bright at the horizon: one step
    for stage, objectives in found.items():
        assert len(objectives) > 1, stage
        for before, after in pairwise(objectives):
            assert after <= before * (1 + 1e-12), stage


@pytest.mark.one_version
def test_prior_makes_factors_readable(two_lobes, two_lobe_steps):
    figures = readability.readability(two_lobe_steps[-1].model)
    assert figures.fresnel_fall < 0.02
    assert figures.ndf_rise < 0.1
    assert figures.dead_lobes == 0
    free = list(fit.fit_steps(two_lobes, quality="draft", prior_strength=0))[-1].model
    without = readability.readability(free)
    assert without.ndf_rise > 0.2
    assert without.turns > 2 * figures.turns


@pytest.mark.one_version
def test_order_of_a_planted_model_is_recovered(planted_steps):
    figures = readability.readability(planted_steps[-1].model)
    assert figures.fresnel_fall < 1e-3
    assert figures.masking_rise < 1e-3
    assert figures.ndf_rise < 3e-3
    assert figures.turns == figures.dead_lobes == 0


def test_lobes_that_an_update_kills_are_revived(coarse, random_model, monkeypatch):
    def killing(problem, moments, model):
        ndf = model.ndf.copy()
        ndf[1] = 0
        return replace(model, ndf=ndf)

    monkeypatch.setattr(fit, "update_ndf", killing)
    start = random_model(0)
    assert (fit.sweep(coarse, start, in_order=True).ndf[1] > 0).all()
    assert not fit.sweep(coarse, start).ndf[1].any()


@pytest.mark.parametrize("name", quality.QUALITIES)
def test_every_quality_ends_where_it_says(two_lobes, name, monkeypatch):
    work = replace(quality.QUALITIES[name], sweeps=1, explore_steps=1, refine_steps=1)
    work = replace(work, polish_steps=min(work.polish_steps, 1), coarse_phi_group=45)
    work = replace(work, appearance_steps=1, maps=1, coarse_angles=60, polish_angles=60)
    monkeypatch.setitem(quality.QUALITIES, name, work)
    steps = list(fit.fit_steps(two_lobes, quality=name))
    assert steps[-1].stage == ("polish" if work.polish_steps else "appearance")
    assert {s.stage for s in steps if s.stage.startswith("explore")} == {
        f"explore {n + 1}" for n in range(work.starts)
    }


@pytest.mark.one_version
def test_objective_is_that_of_the_model(two_lobes, two_lobe_steps):
    problem = Problem(two_lobes, n_angles=quality.QUALITIES["standard"].polish_angles)
    last = two_lobe_steps[-1]
    # the strength is felt less than it is: not all of E can be taken away
    felt, full = (
        joint.objective_of(
            problem,
            last.model,
            strength,
            AppearanceError.of(two_lobes, quality.QUALITIES["standard"].maps),
        )
        for strength in (0, prior.DEFAULT_STRENGTH)
    )
    assert felt < last.objective < full
    assert last.error == pytest.approx(problem.objective_of(last.model), rel=1e-9)
    result = fit.result_of(last, 7, "display-gamma")
    assert problem.objective_of(result.model) == pytest.approx(result.objective, rel=1e-9)
    assert result.objective < last.objective
    assert (result.iterations, result.weight) == (7, "display-gamma")


@pytest.mark.one_version
@pytest.mark.parametrize("fixture", ["two_lobe_steps", "planted_steps"])
def test_progress_runs_from_0_to_1(request, fixture):
    progress = [step.progress for step in request.getfixturevalue(fixture)]
    assert progress[0] == 0
    assert 0.9 < progress[-1] <= 1
    assert (np.diff(progress) >= 0).all()


@pytest.mark.one_version
def test_every_step_is_in_the_gauge(two_lobe_steps):
    for step in two_lobe_steps:
        model = step.model
        for name in FACTORS:
            assert np.isfinite(getattr(model, name)).all()
            assert (getattr(model, name) >= 0).all()
        for name in ("ndf", "masking", "fresnel"):
            np.testing.assert_allclose(getattr(model, name).max(1), 1, rtol=1e-14)


@pytest.mark.one_version
def test_lobes_of_the_result_run_from_narrow_to_wide(two_lobe_steps):
    result = fit.result_of(two_lobe_steps[-1], 1, "display-gamma")
    centres = geometry.theta_h_centres()
    weight = result.model.ndf * np.sin(2 * centres) * np.sqrt(centres)
    width = (weight * np.sqrt(centres)).sum(1) / weight.sum(1)
    assert (np.diff(width) > 0).all()


@pytest.mark.one_version
def test_two_lobes_are_fitted(two_lobes, two_lobe_steps):
    result = fit.result_of(two_lobe_steps[-1], 1, "display-gamma")
    assert result.objective < 2e-4
    table = metrics.tabulate(two_lobe_steps[-1].model)
    assert metrics.mean_log_error(table, two_lobes) < 0.02


@pytest.mark.one_version
@pytest.mark.parametrize("fixture", ["two_lobe_steps", "planted_steps"])
def test_masking_of_the_model_is_that_of_the_fit(request, fixture):
    """The model clamps the curve at 0, the fit does not: it must nowhere make a difference."""
    model = request.getfixturevalue(fixture)[-1].model
    theta = np.linspace(0, np.pi / 2, 5000)
    curve = model.masking @ splines.catmull_rom_taps(theta).matrix().T
    assert curve.min() >= 0
    np.testing.assert_allclose(model.evaluate_masking(theta), curve, atol=1e-15)


@pytest.mark.one_version
@pytest.mark.parametrize("fixture", ["two_lobe_steps", "planted_steps"])
def test_no_value_is_far_above_the_data(request, fixture):
    model = request.getfixturevalue(fixture)[-1].model
    data = request.getfixturevalue(
        {"two_lobe_steps": "two_lobes", "planted_steps": "planted_measurement"}[fixture]
    )
    np.testing.assert_array_equal(model.masking[:, -1], 0)
    assert limits.limits(metrics.tabulate(model), data).peak_ratio < 1.5
    assert tables.largest_directional_albedo(model) <= 1


def test_prior_is_felt_as_much_as_the_error_can_be_taken_away(coarse, planted, monkeypatch):
    error = coarse.objective_of(planted)
    assert error > 10 * coarse.unreachable
    for unreachable, share in ((0, 1), (error / 4, 0.75), (2 * error, fit.LEAST_REACHABLE)):
        monkeypatch.setattr(coarse, "unreachable", unreachable)
        assert fit.felt_strength(0.3, coarse, planted) == pytest.approx(0.3 * share)
        assert fit.felt_strength(0, coarse, planted) == 0


def test_energy_is_limited_at_the_end(short_fit, make_measurement, planted):
    bright = replace(planted, scale=2.5 * planted.scale)
    measurement = make_measurement(metrics.tabulate(bright))
    steps = list(fit.fit_steps(measurement))
    assert steps[-1].stage == "limit"
    assert steps[-1].progress == 1
    assert tables.largest_directional_albedo(steps[-2].model) > 1.1
    assert tables.largest_directional_albedo(steps[-1].model) <= 1
    problem = Problem(measurement, n_angles=quality.QUALITIES["standard"].polish_angles)
    assert steps[-1].error == pytest.approx(problem.objective_of(steps[-1].model))
    assert steps[-1].error > steps[-2].error


@pytest.mark.one_version
def test_planted_model_is_recovered(planted_measurement, planted_steps):
    table = metrics.tabulate(planted_steps[-1].model)
    assert table_psnr(table, planted_measurement) >= 80


@pytest.mark.one_version
def test_planted_model_looks_the_same(planted_measurement, planted_steps):
    table = metrics.tabulate(planted_steps[-1].model)
    scene = sphere.SphereScene([lamps()])
    reference = scene.render(planted_measurement.f_r)
    assert sphere.rendered_psnr(scene.render(table), reference)[0] >= 80


def test_noise_and_missing_bins(short_fit, make_measurement):
    """Two fits of the same data, which is as bad as a real measurement, give the same bytes."""
    rng = np.random.default_rng(0)
    f_r, valid = synthetic.tabulate(synthetic.SAMPLES["copper-paint"], 0.05, rng)
    measurement = make_measurement(f_r, valid & (rng.random(valid.shape) > 0.02))
    result = fit.fit(measurement)
    assert np.isfinite(result.objective)
    assert result.objective < 0.1
    for name in FACTORS:
        assert np.isfinite(getattr(result.model, name)).all()
    steps = list(fit.fit_steps(measurement))
    again = fit.result_of(steps[-1], len(steps), "display-gamma")
    assert again.iterations == result.iterations
    first, second = (
        parameter_file.dumps(FittedMaterial("x", r.model, fit={"objective": r.objective}))
        for r in (result, again)
    )
    assert first.encode() == second.encode()


def test_other_weight(short_fit, two_lobes):
    result = fit.fit(two_lobes, weight="log")
    assert result.weight == "log"
    problem = Problem(two_lobes, weight="log", n_angles=quality.QUALITIES["standard"].polish_angles)
    assert problem.objective_of(result.model) == pytest.approx(result.objective, rel=1e-9)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_black_material(short_fit, make_measurement):
    result = fit.fit(make_measurement(np.full((90, 90, 180, 3), 1e-9)))
    assert all(np.isfinite(getattr(result.model, name)).all() for name in FACTORS)


def test_sweep_can_hold_the_lobes(coarse, random_model):
    start = random_model(0)
    held = fit.sweep(coarse, start, hold_lobes=True).normalized()
    np.testing.assert_allclose(held.ndf, start.normalized().ndf, rtol=1e-12)
    free = fit.sweep(coarse, start)
    assert np.abs(free.ndf - start.normalized().ndf).max() > 0.01
    # this start suits the data so badly that without its lobes the objective is lower
    assert (free.scale > 0).all()
    for model in (held, free):
        assert coarse.objective_of(model) < coarse.objective_of(start)


# --- the Gaussian filter over G ---


@pytest.mark.parametrize("sigma", [0.3, 0.7, 2.0])
def test_filter_keeps_constants(sigma):
    got = fit.gaussian_filtered(np.full((2, 90), 0.4), sigma)
    np.testing.assert_allclose(got, 0.4, rtol=1e-14)


@pytest.mark.parametrize("sigma", [0.3, 0.7, 2.0])
def test_filter_keeps_straight_lines_away_from_the_mirror(sigma):
    line = 1 - np.arange(90) / 200
    got = fit.gaussian_filtered(line[None], sigma)[0]
    reach = int(np.ceil(4 * sigma))
    np.testing.assert_allclose(got[reach:], line[reach:], rtol=1e-13)


def test_filter_of_a_point_is_the_gaussian():
    point = np.zeros((1, 90))
    point[0, 40] = 1
    got = fit.gaussian_filtered(point, 0.7)[0]
    assert got.sum() == pytest.approx(1, rel=1e-13)
    offsets = np.arange(90) - 40
    expected = np.exp(-0.5 * (offsets / 0.7) ** 2)
    np.testing.assert_allclose(got, expected / expected.sum(), atol=2e-5)


def test_filter_mirrors_at_the_normal():
    rng = np.random.default_rng(0)
    curve = rng.random(90)
    even = np.concatenate([curve[:0:-1], curve])[None]  # the same curve on both sides of 0
    got = fit.gaussian_filtered(curve[None], 0.7)[0]
    expected = fit.gaussian_filtered(even, 0.7)[0, 89:]
    np.testing.assert_allclose(got, expected, rtol=1e-13)


def test_filter_is_never_negative():
    falling = np.concatenate([np.zeros(88), [1.0, 0.0]])[None]
    assert fit.gaussian_filtered(falling, 0.7).min() == 0
