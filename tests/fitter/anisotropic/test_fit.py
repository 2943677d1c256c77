# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.anisotropic import albedo as anisotropic_albedo
from fitter.anisotropic import fit as anisotropic_fit
from fitter.anisotropic.problem import AnisotropicProblem
from fitter.fitting import joint, prior
from fitter.fitting.quality import ANISOTROPIC_QUALITIES
from fitter.grading import anisotropic_metrics
from fitter.grading.metrics import numeric_psnr
from tests.anisotropic_measurements import measurement_of, random_pairs
from tests.models import ANISOTROPIC_MODELS


def noisy(model, noise):
    table = anisotropic_metrics.tabulate(model)
    rng = np.random.default_rng(0)
    return measurement_of(table * np.exp(noise * rng.standard_normal(table.shape) - noise**2 / 2))


@pytest.fixture(scope="module")
def measurement():
    return noisy(ANISOTROPIC_MODELS["brushed"], 0.02)


@pytest.fixture(scope="module")
def steps(measurement):
    """A whole fit."""
    return list(anisotropic_fit.fit_steps(measurement, quality="draft"))


@pytest.mark.one_version
def test_a_planted_model_is_recovered():
    truth = ANISOTROPIC_MODELS["brushed"]
    measurement = measurement_of(truth)
    *_, last = anisotropic_fit.fit_steps(measurement)
    table = anisotropic_metrics.tabulate(last.model)
    assert numeric_psnr(table, measurement) > 60
    # between the nodes too, and beyond them
    wi, wo = random_pairs(np.random.default_rng(0), 20_000)
    cosines = wi[:, 2:] * wo[:, 2:]
    error = (last.model.f_r(wi, wo) - truth.f_r(wi, wo)) * cosines
    assert np.abs(error).mean() < 0.01 * (truth.f_r(wi, wo) * cosines).mean()


def test_nothing_rises_over_a_whole_fit(measurement, steps):
    problem = AnisotropicProblem(measurement)
    sweeps = [step for step in steps if step.stage.startswith("sweep")]
    errors = [problem.objective_of(step.model) for step in sweeps]
    assert len(errors) >= 2
    assert (np.diff(errors) <= 1e-12).all()
    for stage, least in (("explore 1", 5), ("refine", 2)):
        objectives = [step.objective for step in steps if step.stage == stage]
        assert len(objectives) >= least
        assert (np.diff(objectives) < 0).all()
    for step in (sweeps[-1], steps[-1]):
        assert step.objective == pytest.approx(
            joint.objective_of(problem, step.model, prior.DEFAULT_STRENGTH), rel=1e-9
        )


def test_noise_does_not_print_through(steps):
    """The fit is nearer to what was there before the noise than the noise is."""
    truth = ANISOTROPIC_MODELS["brushed"]
    clean = measurement_of(truth)
    found = numeric_psnr(anisotropic_metrics.tabulate(steps[-1].model), clean)
    of_noise = numeric_psnr(noisy(truth, 0.02).f_r, clean)
    assert found > of_noise + 3


def test_the_fit_stays_within_energy_and_in_the_gauge(steps):
    model = steps[-1].model
    assert anisotropic_albedo.largest_directional_albedo(model) <= 1
    np.testing.assert_allclose(model.ndf.max((1, 2)), 1)
    np.testing.assert_allclose(model.masking.max((1, 2)), 1)


def test_unseen_numbers_stay_sane(steps):
    """No data has theta_d beyond 75 degrees: F goes on there as it was."""
    fresnel = steps[-1].model.fresnel
    ratio = fresnel[:, 78:] / fresnel[:, 74:75]
    assert ratio.max() < 2
    assert ratio.min() > 0.5


def test_progress(steps):
    progress = [step.progress for step in steps]
    assert (np.diff(progress) > 0).all()
    assert progress[0] == 0
    assert progress[-1] <= 1


def test_the_same_data_gives_the_same_model(measurement, monkeypatch):
    monkeypatch.setitem(
        ANISOTROPIC_QUALITIES, "draft", ANISOTROPIC_QUALITIES["draft"].__class__(2, 2, 1, 1, 1, 1)
    )
    first, second = (
        [step.model for step in anisotropic_fit.fit_steps(measurement, quality="draft")][-1]
        for _ in range(2)
    )
    for name in ("diffuse", "scale", "ndf", "masking", "fresnel"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


def test_light_that_is_not_there_is_taken_back():
    model = ANISOTROPIC_MODELS["brushed"]
    bright = measurement_of(1.5 * anisotropic_metrics.tabulate(model))
    steps = list(anisotropic_fit.fit_steps(bright, quality="draft"))
    assert steps[-1].stage == "limit"
    assert anisotropic_albedo.largest_directional_albedo(steps[-2].model) > 1
    assert anisotropic_albedo.largest_directional_albedo(steps[-1].model) <= 1
