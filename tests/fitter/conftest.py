# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that the tests of the fitter share."""

import numpy as np
import pytest

from fitter import geometry
from fitter.fitting import fit, quality
from fitter.fitting.problem import Problem
from fitter.grading import metrics
from fitter.models import splines
from fitter.models.model import FactorModel
from tests.bases import base_of
from tests.models import MODELS


def smith_masking(theta, alpha):
    cos, sin = np.cos(theta), np.sin(theta)
    return 2 * cos / (cos + np.sqrt(cos**2 + (alpha * sin) ** 2))


@pytest.fixture(scope="session")
def ggx():
    """D of the GGX distribution at the nodes of theta_h: (90,)."""

    def evaluate(alpha):
        cos2 = np.cos(geometry.theta_h_centres()) ** 2
        return alpha**2 / (np.pi * (cos2 * (alpha**2 - 1) + 1) ** 2)

    return evaluate


@pytest.fixture(scope="session")
def planted(ggx):
    """A plausible material that the model holds exactly: three coloured lobes on a dark base."""
    f0 = np.array([0.9, 0.6, 0.4])[:, None]
    nodes = splines.masking_nodes()
    return FactorModel(
        diffuse=np.array([0.02, 0.03, 0.05]),
        scale=np.array([[0.30, 0.25, 0.20], [0.30, 0.35, 0.25], [0.20, 0.25, 0.35]]) / 4,
        ndf=np.stack([ggx(alpha) for alpha in (0.06, 0.2, 0.5)]),
        masking=np.stack([smith_masking(nodes, alpha) for alpha in (0.1, 0.25, 0.6)]),
        fresnel=f0 + (1 - f0) * (1 - np.cos(geometry.theta_d_centres())) ** 5,
    ).normalized()


@pytest.fixture(scope="session")
def random_model():
    """Unrelated random factors, no zeros, not in the gauge."""

    def make(seed):
        rng = np.random.default_rng(seed)
        return FactorModel(
            diffuse=rng.uniform(0.01, 0.1, 3),
            scale=rng.uniform(0.1, 2, (3, 3)),
            ndf=rng.uniform(0.1, 3, (3, 90)),
            masking=rng.uniform(0.3, 1.5, (3, 90)) * (np.cos(splines.masking_nodes()) + 0.01),
            fresnel=rng.uniform(0.2, 2, (3, 90)),
        )

    return make


@pytest.fixture(scope="session")
def planted_measurement(planted, make_measurement):
    return make_measurement(metrics.tabulate(planted))


@pytest.fixture(scope="session")
def bases():
    """Base lobes of MODELS by name."""
    return {name: base_of(name) for name in MODELS}


@pytest.fixture(scope="session")
def coarse(two_lobes):
    """A problem on which everything takes milliseconds."""
    return Problem(two_lobes, phi_group=9, n_angles=120)


@pytest.fixture(scope="session")
def tiny(two_lobes):
    """The smallest problem there is."""
    return Problem(two_lobes, phi_group=45, n_angles=60)


@pytest.fixture(scope="session")
def two_lobe_steps(two_lobes):
    """A whole fit."""
    return list(fit.fit_steps(two_lobes))


@pytest.fixture(scope="session")
def planted_steps(planted_measurement):
    """A whole fit."""
    return list(fit.fit_steps(planted_measurement))


@pytest.fixture
def short_fit(monkeypatch):
    """Fits that run through every stage but take a step or two in each."""
    short = quality.Quality(
        starts=3,
        sweeps=1,
        explore_steps=1,
        finalists=2,
        final_steps=1,
        refine_steps=1,
        appearance_steps=1,
        maps=1,
        coarse_phi_group=45,
        coarse_angles=60,
        polish_steps=1,
        polish_angles=60,
    )
    for name in quality.QUALITIES:
        monkeypatch.setitem(quality.QUALITIES, name, short)
    monkeypatch.setattr(fit, "REFINE_JOINT_STEPS", 1)


@pytest.fixture(scope="session")
def upper_directions():
    """n random unit directions above the horizon; every fourth is grazing, down to cos 1e-9."""

    def make(rng, n):
        z = rng.random(n)
        z[::4] = 10 ** rng.uniform(-9, -2, len(z[::4]))
        phi = rng.uniform(0, 2 * np.pi, n)
        sin = np.sqrt(1 - z * z)
        return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)

    return make
