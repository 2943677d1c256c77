# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.baselines import independent_g
from fitter.baselines.independent_g import IndependentG
from fitter.fitting import fit as shared
from fitter.fitting.problem import Problem
from fitter.fitting.quality import QUALITIES, Quality
from fitter.grading import metrics

DIAGONAL = np.eye(3, dtype=bool)


@pytest.fixture(scope="module")
def planted_by_channel(planted):
    """The planted model with a lobe for each channel: another D, F and G for each."""
    return replace(planted, scale=np.diag(planted.scale.sum(0)))


@pytest.fixture(scope="module")
def measured_by_channel(planted_by_channel, make_measurement):
    return make_measurement(metrics.tabulate(planted_by_channel))


@pytest.fixture
def effort(monkeypatch):
    """Set the effort of a fit; angle bins fine enough to see the planted model through them."""

    def set_to(sweeps, joint_steps, rounds, **resolution):
        work = Quality(3, sweeps, joint_steps, 1, 3, 4 * rounds, 2, 1, 15, 360, 2, 720)
        monkeypatch.setitem(QUALITIES, "standard", replace(work, **resolution))
        monkeypatch.setattr(shared, "REFINE_JOINT_STEPS", 4)

    return set_to


def test_816_numbers(planted_by_channel):
    assert IndependentG(planted_by_channel).n_parameters == 816


def test_channels_have_nothing_in_common(planted_by_channel, upper_directions):
    rng = np.random.default_rng(0)
    wi, wo = upper_directions(rng, 50), upper_directions(rng, 50)
    before = IndependentG(planted_by_channel).f_r(wi, wo)
    ndf = planted_by_channel.ndf.copy()
    ndf[1] *= 2
    after = IndependentG(replace(planted_by_channel, ndf=ndf)).f_r(wi, wo)
    np.testing.assert_array_equal(after[:, [0, 2]], before[:, [0, 2]])
    assert (after[:, 1] > before[:, 1]).all()


def test_planted_model_is_recovered(effort, measured_by_channel):
    effort(sweeps=3, joint_steps=1, rounds=3)
    fitted = independent_g.fit(measured_by_channel)
    np.testing.assert_array_equal(fitted.factors.scale > 0, DIAGONAL)
    table = metrics.tabulate(fitted)
    assert metrics.relative_objective(table, measured_by_channel) < 3e-5


def test_alternation_with_golden_sections_recovers_it_too(effort, measured_by_channel):
    effort(sweeps=4, joint_steps=1, rounds=1, polish_angles=360)
    fitted = independent_g.fit(measured_by_channel, golden_section=True)
    np.testing.assert_array_equal(fitted.factors.scale > 0, DIAGONAL)
    table = metrics.tabulate(fitted)
    assert metrics.relative_objective(table, measured_by_channel) < 2e-3


@pytest.mark.parametrize(
    "masking_update", [independent_g.update_masking, independent_g.update_masking_bagher2016]
)
def test_sweeps_never_raise_the_objective(coarse, random_model, masking_update):
    start = random_model(0)
    model = replace(start, scale=np.diag(np.diag(start.scale)))
    before = coarse.objective_of(model)
    for _ in range(4):
        model = independent_g.sweep(coarse, model, masking_update)
        after = coarse.objective_of(model)
        assert after <= before * (1 + 1e-12)
        before = after
    np.testing.assert_array_equal(model.scale > 0, DIAGONAL)


def test_diffuse_and_scale_are_the_least(coarse, planted):
    start = replace(planted, scale=np.eye(3))
    moments = coarse.moments(coarse.kernels(start.masking))
    model = independent_g.update_diffuse_and_scale(coarse, moments, start)
    least = coarse.objective(model, moments)
    assert (model.diffuse > 0).sum() >= 2
    for channel in range(3):
        for step in (0.99, 1.01):
            scale, diffuse = model.scale.copy(), model.diffuse.copy()
            scale[channel, channel] *= step
            diffuse[channel] *= step
            assert coarse.objective(replace(model, scale=scale), moments) > least
            if model.diffuse[channel] > 0:
                assert coarse.objective(replace(model, diffuse=diffuse), moments) > least


def test_a_scale_never_becomes_zero(coarse, random_model):
    """Where a channel wants no lobe its D must survive until another sweep does."""
    start = random_model(2)
    away = replace(start, ndf=np.where(np.arange(90) > 80, 1.0, 1e-9) * np.ones((3, 1)))
    moments = coarse.moments(coarse.kernels(away.masking))
    model = independent_g.update_diffuse_and_scale(coarse, moments, away)
    np.testing.assert_array_equal(model.scale > 0, DIAGONAL)


def test_channels_of_very_different_scale_do_not_disturb_each_other(coarse, planted_by_channel):
    """In the gauge of maximum 1 the scales may lie far apart without meaning anything."""
    factor = np.array([1e10, 1, 1])
    model = replace(
        planted_by_channel,
        scale=planted_by_channel.scale * factor,
        ndf=planted_by_channel.ndf / factor[:, None],
    )
    moments = coarse.moments(coarse.kernels(model.masking))
    together = independent_g.update_diffuse_and_scale(coarse, moments, model)
    plain = independent_g.update_diffuse_and_scale(coarse, moments, planted_by_channel)
    expected = np.diag(plain.scale) * factor
    np.testing.assert_allclose(np.diag(together.scale), expected, rtol=1e-9)


def test_each_channel_takes_its_best_start(coarse, planted_by_channel):
    worse = replace(
        planted_by_channel,
        ndf=planted_by_channel.ndf[:, ::-1],
        scale=planted_by_channel.scale * 3,
        diffuse=planted_by_channel.diffuse + 1,
    )

    def mixed(better, channel):
        rows = {
            name: np.where(
                (np.arange(3) == channel)[(slice(None),) + (None,) * (array.ndim - 1)],
                array,
                getattr(worse, name),
            )
            for name, array in vars(better).items()
        }
        return replace(better, **rows)

    models = [mixed(planted_by_channel, channel) for channel in (2, 0, 1)]
    errors = [independent_g.channel_errors(coarse, model) for model in models]
    np.testing.assert_array_equal(np.argmin(errors, axis=0), [1, 2, 0])
    best = independent_g._best_of_each_channel(coarse, models)
    for name, array in vars(planted_by_channel).items():
        np.testing.assert_array_equal(getattr(best, name), array)


def test_errors_of_the_channels_add_up(coarse, planted_by_channel):
    total = independent_g.channel_errors(coarse, planted_by_channel).sum()
    expected = coarse.objective_of(planted_by_channel)
    assert 1 + total / coarse.target_energy == pytest.approx(expected, rel=1e-9)


def test_golden_section_is_used_where_the_proposal_overshoots(monkeypatch, coarse, random_model):
    """Far from the optimum the averaged, smoothed G is worse, and only part of the way is gone."""
    shares = []
    search = independent_g.golden_section_search

    def recorded(*arguments):
        shares.append(search(*arguments))
        return shares[-1]

    monkeypatch.setattr(independent_g, "golden_section_search", recorded)
    for seed in range(3):
        start = random_model(seed)
        model = replace(start, scale=np.diag(np.diag(start.scale)))
        kernels = coarse.kernels(model.masking)
        before = coarse.objective_of(model)
        for channel in range(3):
            model = independent_g.update_masking_bagher2016(coarse, kernels, model, channel)
        assert coarse.objective_of(model) <= before
        for _ in range(12):
            model = independent_g.sweep(coarse, model, independent_g.update_masking_bagher2016)
    assert shares
    assert all(0 <= share < 1 for share in shares)


def test_every_start_offers_its_best_lobe(coarse):
    for start in shared.STARTS:
        model = independent_g._one_lobe(coarse, start(coarse))
        np.testing.assert_array_equal(model.scale > 0, DIAGONAL)
        assert coarse.objective_of(model) < 0.5


def test_effort_is_that_of_our_fit(monkeypatch, effort, two_lobes):
    """As many starts, sweeps, joint steps and stages; only the sweeps that choose lobes on top."""
    coarse = {"coarse_phi_group": 45, "coarse_angles": 60, "polish_angles": 60}
    effort(sweeps=1, joint_steps=1, rounds=1, **coarse)
    counts = {"sweep": 0, "step": 0, "appearance": 0}
    sweep, refine = independent_g.sweep, independent_g.joint.refine

    def counted_sweep(problem, model, *rest):
        counts["sweep"] += 1
        return sweep(problem, model, *rest)

    def counted_refine(problem, model, appearance=None):
        for step in refine(problem, model, appearance=appearance):
            counts["step" if appearance is None else "appearance"] += 1
            yield step

    monkeypatch.setattr(independent_g, "sweep", counted_sweep)
    monkeypatch.setattr(independent_g.joint, "refine", counted_refine)
    monkeypatch.setattr(shared, "CONVERGED", -1)
    independent_g.fit(two_lobes)
    assert counts == {"sweep": 3 * (3 + 1) + 1, "step": 3 * (1 + 1) + 4, "appearance": 2 + 2}


def test_objective_of_the_table_is_that_of_the_problem(planted_by_channel, two_lobes):
    table = metrics.tabulate(IndependentG(planted_by_channel))
    snapped = Problem(two_lobes, n_angles=720).objective_of(planted_by_channel)
    assert metrics.relative_objective(table, two_lobes) == pytest.approx(snapped, rel=5e-3)
