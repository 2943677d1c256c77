# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from benchmarks import experiment, shared_data


@pytest.fixture
def synthetic(monkeypatch, two_lobes):
    """No shared materials: the same synthetic one under every name, in a white room."""
    monkeypatch.setattr(shared_data, "require_shared", lambda: None)
    monkeypatch.setattr(shared_data, "read_material", lambda name: two_lobes)
    monkeypatch.setattr(experiment, "environment_maps", lambda: [np.ones((128, 256, 3))])
    return two_lobes


def test_materials_come_with_the_worth_of_a_table(synthetic):
    first, second = experiment.materials(["one", "two"])
    assert (first.name, second.name) == ("one", "two")
    assert first.measurement is synthetic
    table = synthetic.f_r
    exact, near, far = (first.psnr(table * factor) for factor in (1, 1.01, 1.2))
    assert exact > 100 > near > far + 10
    # under uniform light 1 % more is 1 % everywhere: display values of 0.3^(1/2.2), about
    assert near == pytest.approx(-20 * np.log10(0.01 / 2.2 * 0.3 ** (1 / 2.2)), abs=1.5)


def test_nothing_is_read_before_its_turn(synthetic, monkeypatch):
    monkeypatch.setattr(shared_data, "read_material", lambda name: pytest.fail(name))
    experiment.materials(["one"])
