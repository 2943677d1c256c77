# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.grading import readability
from fitter.grading.readability import count_turns


def test_a_plausible_material_is_readable(planted):
    got = readability.readability(planted)
    assert got.fresnel_fall == got.masking_rise == got.turns == got.dead_lobes == 0
    assert got.ndf_rise == 0
    assert set(got.figures()) == {
        "fresnel_fall", "masking_rise", "ndf_rise", "turns", "dead_lobes",
    }  # fmt: skip


def test_each_figure_sees_its_fault(planted):
    fresnel = planted.fresnel.copy()
    fresnel[1, 80:] = fresnel[1, 79] - 0.2
    masking = planted.masking.copy()
    masking[2, 50:60] += 0.3
    ndf = planted.ndf.copy()
    ndf[0, 60:70] *= 100
    scale = planted.scale.copy()
    scale[1] = 1e-9
    got = readability.readability(replace(planted, fresnel=fresnel))
    assert got.fresnel_fall == pytest.approx(0.2 / fresnel[1].max())
    assert got.turns == 1
    got = readability.readability(replace(planted, masking=masking))
    # the curve itself falls a little within the step
    assert 0.2 < got.masking_rise < 0.3
    assert got.turns == 2
    got = readability.readability(replace(planted, ndf=ndf))
    floored = np.log10(planted.ndf[0] + readability.NDF_FLOOR)
    raised = np.log10(ndf[0] + readability.NDF_FLOOR)
    assert got.ndf_rise == pytest.approx(raised[60] - floored[59])
    assert got.turns == 1  # the fall behind it is what a peak may have
    assert readability.readability(replace(planted, scale=scale)).dead_lobes == 1


@pytest.mark.parametrize(
    ("curve", "expected"),
    [
        ([0, 1, 2, 3], 0),
        ([3, 2, 1], 0),
        ([1, 1, 1], 0),
        ([0, 1, 0.99, 2], 0),  # smaller than a turn
        ([0, 1, 0.5], 1),
        ([0, 1, 0.5, 0.7, 0], 3),
        ([0, -0.05, -0.1, 0, 1], 1),
        ([0, 0.05, 0.1, 0], 1),
        ([0, 0.05, 0.04, 0.03, 0.02, 0.01], 1),  # slowly, but by more than a turn in all
    ],
)
def test_turns(curve, expected):
    assert count_turns(np.array(curve, dtype=float), 0.03) == expected
    assert count_turns(-np.array(curve, dtype=float), 0.03) == expected
    assert count_turns(np.repeat(curve, 2).astype(float), 0.03) == expected
