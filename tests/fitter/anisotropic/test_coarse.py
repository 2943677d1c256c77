# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import coarse
from fitter.anisotropic.coarse import CoarseModel
from fitter.anisotropic.joint import normal_equations
from fitter.anisotropic.problem import AnisotropicProblem
from fitter.fitting import joint
from tests.anisotropic_measurements import measurement_of, random_pairs
from tests.models import ANISOTROPIC_MODELS

MODEL = ANISOTROPIC_MODELS["brushed"]


@pytest.fixture(scope="module")
def problem():
    return AnisotropicProblem(measurement_of(ANISOTROPIC_MODELS["pile"]), step=coarse.STEP)


def test_every_second_azimuth_stays():
    few = CoarseModel.of(MODEL)
    np.testing.assert_array_equal(few.ndf[:, :, ::2], MODEL.ndf[:, :, ::2])
    between = np.sqrt(MODEL.masking[:, 1:, :-2:2] * MODEL.masking[:, 1:, 2::2])
    np.testing.assert_allclose(few.masking[:, 1:, 1:-1:2], between)
    around = np.sqrt(MODEL.ndf[:, 1:, -2] * MODEL.ndf[:, 1:, 0])
    np.testing.assert_allclose(few.ndf[:, 1:, -1], around)
    np.testing.assert_array_equal(few.ndf[:, 0], MODEL.ndf[:, 0])
    again = CoarseModel.full_tables(CoarseModel.free_numbers(few.ndf))
    np.testing.assert_array_equal(again, few.ndf)
    wi, wo = random_pairs(np.random.default_rng(0), 100)
    assert type(few.refined()) is type(MODEL)
    np.testing.assert_array_equal(few.refined().f_r(wi, wo), few.f_r(wi, wo))


def test_its_problem_sees_pairs_of_these_azimuths(problem):
    seen = np.unique(problem.nodes.index)
    assert len(seen) == coarse.N_FREE
    azimuths = (seen[1:] - 1) % polar_grid.N_PHI
    assert set(azimuths) == set(range(0, polar_grid.N_PHI, coarse.STEP))
    assert problem.weight.shape == (3, coarse.N_FREE * (coarse.N_FREE + 1) // 2)


def test_gradient_is_that_of_the_objective(problem):
    few = CoarseModel.of(MODEL)
    layout = joint.Layout.of(few)
    value, normal, gradient = normal_equations(problem, few, layout)
    assert normal.shape == (layout.size, layout.size) == (1008, 1008)
    assert value == pytest.approx(problem.objective_of(few))
    x = layout.pack(few)
    for position in (1, 130, 400, layout.masking.start + 7, layout.scale.start, layout.size - 1):
        step = np.zeros(layout.size)
        step[position] = 1e-5
        ends = [problem.objective_of(layout.unpack(x + d, few)) for d in (step, -step)]
        slope = (ends[0] - ends[1]) / 2e-5 * problem.target_energy
        assert -2 * gradient[position] == pytest.approx(slope, rel=1e-4, abs=1e-9)
    np.testing.assert_allclose(normal, normal.T)
