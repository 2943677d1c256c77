# SPDX-License-Identifier: GPL-3.0-or-later
"""Mute and solo."""

import numpy as np
import pytest


@pytest.fixture
def material(addon, fitted):
    return addon("material").build(fitted)


@pytest.fixture
def links(addon, material):
    """What feeds what inside the group."""

    def read():
        group = addon("node_group").find_group_node(material).node_tree
        return {
            (
                link.from_node.name,
                link.from_socket.identifier,
                link.to_node.name,
                link.to_socket.identifier,
            )
            for link in group.links
        }

    return read


@pytest.mark.parametrize(
    ("mute", "solo", "shown"),
    [
        ((0, 0, 0), (0, 0, 0), [True, True, True]),
        ((1, 0, 1), (0, 0, 0), [False, True, False]),
        ((0, 0, 0), (0, 1, 0), [False, True, False]),
        ((0, 1, 0), (0, 1, 1), [False, True, True]),
    ],
)
def test_solo_wins_over_mute(mute, solo, shown, addon):
    found = addon("lobes").audible([bool(m) for m in mute], [bool(s) for s in solo])
    assert found == shown


def test_muting_and_back_leaves_the_group_as_it_was(material, links):
    before = links()
    material.nfm.mute[1] = True
    material.nfm.solo[0] = True
    assert links() != before
    material.nfm.mute = material.nfm.solo = (False,) * 3
    assert links() == before


def test_what_is_muted_is_not_in_the_picture(addon, material, render, sphere_scene):
    inputs = addon("node_group").find_group_node(material).inputs
    inputs["Diffuse"].default_value = (0, 0, 0, 1)
    full = render(sphere_scene(material))
    material.nfm.solo[2] = True
    third = render(sphere_scene(material))
    material.nfm.mute = (True, True, True)
    material.nfm.solo = (False, False, False)
    nothing = render(sphere_scene(material))
    centre = np.s_[8:16, 8:16]
    assert nothing[centre].max() == 0
    assert 0 < third[centre].mean() < 0.8 * full[centre].mean()
    # the scale itself is not touched
    assert inputs["Lobe 1 Scale"].default_value[:] == (1, 1, 1, 1)


def test_a_material_without_its_nodes_does_no_harm(material, capfd):
    material.node_tree.nodes.clear()
    material.nfm.mute[0] = True
    assert "has no NFM BRDF node any more" in capfd.readouterr().out
