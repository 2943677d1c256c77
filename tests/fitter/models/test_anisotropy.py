# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.models.anisotropy import anisotropy
from tests.models import ANISOTROPIC_MODELS


def turned(model, steps):
    """The material turned counter-clockwise by steps of 7.5 degrees."""
    return replace(
        model,
        ndf=np.roll(model.ndf, steps, axis=2),
        masking=np.roll(model.masking, steps, axis=2),
    )


@pytest.mark.parametrize("steps", [0, 3, 12, 17, -8])
def test_marks_are_found_however_the_sample_lies(steps):
    found = anisotropy(turned(ANISOTROPIC_MODELS["brushed"], steps))
    assert (found.direction - 7.5 * steps + 90) % 180 - 90 == pytest.approx(0, abs=0.2)
    assert -90 <= found.direction < 90
    assert found.strength > 0.5


def test_between_the_nodes():
    brushed = ANISOTROPIC_MODELS["brushed"]
    mixed = replace(brushed, ndf=(brushed.ndf + np.roll(brushed.ndf, 1, axis=2)) / 2)
    assert anisotropy(mixed).direction == pytest.approx(3.75, abs=0.3)


def test_the_stronger_of_two_families_of_threads():
    brushed = ANISOTROPIC_MODELS["brushed"]
    across = np.roll(brushed.ndf, 12, axis=2)
    woven = replace(brushed, ndf=(0.6 * brushed.ndf + 0.4 * across))
    assert anisotropy(woven).direction == pytest.approx(0, abs=0.5)
    assert anisotropy(turned(woven, 12)).direction == pytest.approx(-90, abs=0.5)


def test_the_gauge_does_not_matter():
    model = turned(ANISOTROPIC_MODELS["satin"], 5)
    other = replace(
        model,
        ndf=model.ndf * np.array([1, 1e-3, 50])[:, None, None],
        scale=model.scale / np.array([1, 1e-3, 50])[:, None],
    )
    found, again = anisotropy(model), anisotropy(other)
    assert again.direction == pytest.approx(found.direction, abs=1e-9)
    assert again.strength == pytest.approx(found.strength, rel=1e-9)


def test_isotropic_and_black_materials_have_none():
    model = ANISOTROPIC_MODELS["brushed"]
    level = replace(
        model,
        ndf=np.repeat(model.ndf[:, :, :1], 48, axis=2),
        masking=np.repeat(model.masking[:, :, :1], 48, axis=2),
    )
    assert anisotropy(level).strength == pytest.approx(0, abs=1e-9)
    assert anisotropy(replace(model, scale=np.zeros((3, 3)))).strength == 0
