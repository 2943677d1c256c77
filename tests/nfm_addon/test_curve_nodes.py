# SPDX-License-Identifier: GPL-3.0-or-later
"""Curve widgets in the node group of a material."""

import numpy as np
import pytest

from fitter.editing import curves
from fitter.editing.curves import CURVES_OF, MOST_HANDLES
from tests.models import MODELS

ISOTROPIC = CURVES_OF["isotropic"]


@pytest.fixture
def nodes(addon):
    return addon("curve_nodes")


@pytest.fixture
def group(blender, nodes):
    group = blender.data.node_groups.new("curves", "ShaderNodeTree")
    nodes.ensure(group, ISOTROPIC)
    return group


@pytest.mark.parametrize("name", MODELS)
def test_few_handles_show_the_factor(name, nodes, group):
    drawn = curves.drawn(MODELS[name])
    nodes.draw(group, drawn)
    handles = nodes.handles(group)
    assert tuple(handles) == ISOTROPIC
    for curve, heights in nodes.heights(group).items():
        assert 2 <= len(handles[curve]) <= MOST_HANDLES
        error = np.abs(heights - drawn[curve]).max()
        full = len(handles[curve]) == MOST_HANDLES
        # Blender looks a curve up in a table of 256 heights: between them it is off, too
        assert error < (0.05 if full else 2 * curves.TOLERANCE), curve


def test_each_curve_is_shown_in_its_place(nodes, group):
    flat = {name: np.full(90, number / 10) for number, name in enumerate(ISOTROPIC)}
    nodes.draw(group, flat)
    for name, heights in nodes.heights(group).items():
        np.testing.assert_allclose(heights, flat[name], atol=1e-6)
    # the widget of F shows all channels first, then red, green, blue
    curve = group.nodes["F"].mapping.curves
    assert [c.points[0].location[1] for c in curve] == pytest.approx([0.7, 0.8, 0.9, 0.6])


def test_handles_are_written_and_read(nodes, group):
    wanted = ((0.0, 0.5, "AUTO"), (0.25, 0.75, "VECTOR"), (1.0, 0.0, "AUTO_CLAMPED"))
    nodes.write(group, {"Lobe 2 G": wanted, "F Blue": wanted[::2]})
    found = nodes.handles(group)
    assert found["Lobe 2 G"] == wanted
    assert found["F Blue"] == wanted[::2]
    assert len(found["F Green"]) == 2


def test_what_a_script_moves_is_seen_without_its_update(nodes, group):
    before = nodes.heights(group)["Lobe 1 D"]
    group.nodes["Lobe 1 D"].mapping.curves[0].points[1].location = (1.0, 0.25)
    after = nodes.heights(group)["Lobe 1 D"]
    assert after[-1] < 0.3 < before[-1]


def test_removed_nodes_are_left_out_and_added_again(nodes, group):
    group.nodes.remove(group.nodes["Lobe 3 D"])
    assert "Lobe 3 D" not in nodes.handles(group)
    assert "Lobe 3 D" not in nodes.heights(group)
    nodes.write(group, {"Lobe 3 D": ((0, 0, "AUTO"), (1, 1, "AUTO"))})
    count = len(group.nodes)
    nodes.ensure(group, ISOTROPIC)
    assert len(group.nodes) == count + 1
    nodes.ensure(group, ISOTROPIC)
    assert len(group.nodes) == count + 1


def test_layout_can_be_read(nodes, group):
    """No two nodes on top of each other, all in one frame."""
    widgets = [node for node in group.nodes if node.type != "FRAME"]
    assert len({tuple(node.location) for node in widgets}) == len(widgets) == 7
    for node in widgets:
        assert node.parent == group.nodes["Curves"]
        assert node.label.startswith(node.name)
        assert not any(socket.is_linked for socket in (*node.inputs, *node.outputs))
