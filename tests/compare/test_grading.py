# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from compare import grading
from compare.models import CONTENDERS, INDEPENDENT_G, KEYS, OURS, Settings
from fitter.baselines.bivariate import Bivariate
from fitter.baselines.independent_g import IndependentG
from fitter.baselines.principled import Principled
from fitter.grading import metrics
from fitter.pictures import sphere
from tests.models import MODELS

FACTORS = MODELS["paint"]
FITTED = (
    FACTORS,
    IndependentG(replace(FACTORS, scale=np.diag(FACTORS.scale.sum(0)))),
    Bivariate(np.full((90, 90, 3), 0.2)),
    Principled(np.full(3, 0.1), np.full(3, 0.04), np.ones(3), 0.2),
)
SETTINGS = Settings("log")


@pytest.fixture(scope="module")
def tables(two_lobes):
    """What stands for the tables of the models; tabulating has tests of its own."""
    return [factor * two_lobes.f_r for factor in (1.01, 0.9, 1.2, 0.5)]


@pytest.fixture(scope="module")
def graded(two_lobes, tables):
    """A grade without fits, and the arguments that the fits had."""
    asked = []

    def instead(contender, fitted):
        return replace(contender, fit=lambda *arguments: asked.append(arguments) or fitted)

    contenders = tuple(map(instead, CONTENDERS, FITTED))
    scene = sphere.SphereScene([np.random.default_rng(0).random((64, 128, 3))], resolution=12)
    steps = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(grading, "CONTENDERS", contenders)
        table_of = {id(model): table for model, table in zip(FITTED, tables, strict=True)}
        patch.setattr(grading, "tabulate", lambda model: table_of[id(model)])
        result = grading.grade(two_lobes, SETTINGS, [scene], lambda: steps.append(None))
    assert asked == [(two_lobes, SETTINGS)] * len(KEYS)
    assert len(steps) == len(KEYS)
    return result, scene


def test_figures_are_those_of_the_metrics(graded, tables, two_lobes):
    result, scene = graded
    assert (result.name, result.sha256) == ("planted", two_lobes.source.sha256)
    assert list(result.grades) == list(KEYS)
    reference = scene.render(two_lobes.f_r)
    for key, table, count in zip(KEYS, tables, (822, 816, 24300, 10), strict=True):
        grades = result.grades[key]
        assert grades.n_parameters == count
        assert grades.objective == metrics.relative_objective(table, two_lobes, "log")
        assert grades.mean_log_error == metrics.mean_log_error(table, two_lobes)
        assert grades.numeric_psnr == metrics.numeric_psnr(table, two_lobes)
        expected = sphere.rendered_psnr(scene.render(table), reference)
        assert grades.rendered_psnr == pytest.approx(expected.tolist(), rel=1e-12)
        assert grades.mean_psnr == pytest.approx(expected[0], rel=1e-12)


def test_pictures_are_those_of_the_scene(graded, tables, two_lobes):
    result, scene = graded
    (pictures,) = result.pictures
    assert pictures.shape == (1 + len(KEYS), 12, 12, 3)
    np.testing.assert_array_equal(np.isnan(pictures[..., 0]), np.tile(~scene.mask, (5, 1, 1)))
    for picture, table in zip(pictures, [two_lobes.f_r, *tables], strict=True):
        np.testing.assert_allclose(picture[scene.mask], scene.render(table)[0], rtol=1e-6)


def test_factors_are_kept(graded):
    factors = graded[0].factors
    assert factors[OURS] is FACTORS
    assert factors[INDEPENDENT_G] is FITTED[1].factors
    assert len(factors) == 2
