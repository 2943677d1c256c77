# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter import polar_grid
from fitter.anisotropic import albedo as anisotropic_albedo
from fitter.editing.energy import within_energy
from fitter.geometry import theta_d_centres
from fitter.models import tables
from tests.models import ANISOTROPIC_MODELS, MODELS

ALL = MODELS | ANISOTROPIC_MODELS
VIEWS = np.radians([0, 20, 40, 60, 70, 78, 84, 87])


def albedo(model):
    """Largest over channels (views,), down to 75 degrees for an anisotropic model.

    Beyond, its G follows from that row, which is lowered for the largest of them.
    """
    if model.kind == "anisotropic":
        theta, phi = np.meshgrid(np.radians([0, 20, 45, 60, 75]), [0, 0.7, 1.6, 3.5], indexing="ij")
        views = polar_grid.unit_vectors(theta.ravel(), phi.ravel())
        return anisotropic_albedo.directional_albedo(model, views).max(1)
    return tables.directional_albedo(model, VIEWS).max(1)


@pytest.mark.parametrize("model", ALL.values(), ids=ALL)
def test_what_is_within_energy_is_left_alone(model):
    assert within_energy(model) is model


@pytest.mark.parametrize("name", ["plastic", "metal", "paint", "brushed"])
@pytest.mark.parametrize("where", ["everywhere", "at the edge"])
def test_too_much_light_is_lowered_to_all_there_is_and_no_further(name, where):
    model = ALL[name]
    if where == "everywhere":
        bright = replace(model, scale=6 * model.scale)
    else:
        rise = 1 + 8 * (1 - np.cos(theta_d_centres())) ** 3
        bright = replace(model, fresnel=model.fresnel * rise)
    before, after = albedo(bright), albedo(within_energy(bright))
    assert before.max() > 1.5
    assert after.max() <= 1.003
    assert after[before > 1].min() > 0.85
    assert (after <= before * (1 + 1e-9)).all()


@pytest.mark.parametrize("name", ["metal", "brushed"])
def test_no_room_is_no_light(name):
    full = replace(ALL[name], diffuse=np.full(3, 1 / np.pi))
    limited = within_energy(full)
    assert not limited.masking.any()
    assert np.isfinite(limited.masking).all()


def test_only_the_masking_changes():
    bright = replace(MODELS["metal"], scale=4 * MODELS["metal"].scale)
    limited = within_energy(bright)
    for factor in ("diffuse", "scale", "ndf", "fresnel"):
        np.testing.assert_array_equal(getattr(limited, factor), getattr(bright, factor))


def test_poles_stay_tied():
    bright = replace(ANISOTROPIC_MODELS["brushed"], scale=8 * ANISOTROPIC_MODELS["brushed"].scale)
    pole = within_energy(bright).masking[:, 0]
    np.testing.assert_array_equal(pole, pole[:, :1].repeat(48, 1))


@pytest.mark.parametrize("column", [1, 2, 3])
def test_a_ridge_between_the_coarse_azimuths_is_lowered_too(column):
    model = ANISOTROPIC_MODELS["brushed"]
    masking = 0.5 * model.masking
    masking[:, 1:, column] *= 8
    bright = replace(model, masking=masking)
    views = polar_grid.unit_vectors(np.radians([15, 45, 75]), np.full(3, np.radians(7.5 * column)))

    def albedo_of(model):
        return anisotropic_albedo.directional_albedo(model, views).max(1)

    assert albedo_of(bright).max() > 1.5
    assert albedo_of(within_energy(bright)).max() <= 1.015  # by a coarser integral
