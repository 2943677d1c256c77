# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from fitter.line_search import golden_section_search, least_around_nodes


@pytest.mark.parametrize("least", [-0.9, 0.123456, 2.7])
def test_finds_the_least_of_a_valley(least):
    got = golden_section_search(lambda x: abs(x - least) ** 1.5, -1, 3, tolerance=1e-6)
    assert got == pytest.approx(least, abs=1e-6)


@pytest.mark.parametrize("end", [0, 1])
def test_the_least_may_be_an_end(end):
    assert golden_section_search(lambda x: abs(x - end), 0, 1) == pytest.approx(end, abs=1e-3)


def test_one_evaluation_a_step():
    asked = []

    def function(x):
        asked.append(x)
        return (x - 0.3) ** 2

    golden_section_search(function, 0, 1, tolerance=1e-3)
    # 0.618^15 < 1e-3 < 0.618^14: two points to start with, one for each of 15 steps
    assert len(asked) == 17


@pytest.mark.parametrize("least", [0.0, 1.3, 4.4, 5.0])
def test_valley_of_several_is_found_by_its_node(least):
    """Shallow valleys around the other nodes are left alone."""

    def function(x):
        return min(abs(x - least), 0.5 + abs(x - round(x)))

    got = least_around_nodes(function, range(6), tolerance=1e-5)
    assert got == pytest.approx(least, abs=1e-5)
