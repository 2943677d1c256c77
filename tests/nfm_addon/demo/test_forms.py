"""The meshes of the demo."""

from itertools import pairwise

import numpy as np
import pytest


@pytest.fixture
def forms(addon):
    return addon("demo.forms")


def edges_and_their_faces(mesh):
    counts = {}
    for polygon in mesh.polygons:
        for edge in polygon.edge_keys:
            counts[edge] = counts.get(edge, 0) + 1
    return counts


def volume(mesh):
    """By the divergence theorem; positive where faces look outwards."""
    corners = np.array([vertex.co for vertex in mesh.vertices])
    total = 0.0
    for polygon in mesh.polygons:
        first, *rest = corners[list(polygon.vertices)]
        for a, b in pairwise(rest):
            total += first @ np.cross(a, b) / 6
    return total


def test_the_form_is_closed_and_looks_outwards(forms):
    mesh = forms.form_mesh()
    assert set(edges_and_their_faces(mesh).values()) == {2}
    assert 0.4 < volume(mesh) < 0.8
    height = [vertex.co.z for vertex in mesh.vertices]
    assert min(height) == 0
    assert max(height) == pytest.approx(forms.FORM_PROFILE[-1][1])
    assert all(polygon.use_smooth for polygon in mesh.polygons)


def test_the_form_has_a_groove_a_rim_and_flutes(forms):
    mesh = forms.form_mesh()
    at = np.array([vertex.co for vertex in mesh.vertices])
    radius = np.hypot(at[:, 0], at[:, 1])
    height = at[:, 2]

    def between(low, high):
        return radius[(height > low) & (height < high)]

    rim, below, above = between(0.88, 0.9), between(0.82, 0.845), between(0.89, 0.9)
    assert rim.max() > below.max() + 0.08
    assert above.min() < rim.max() - 0.08  # the groove between rim and dome
    body = between(0.45, 0.55)
    assert np.ptp(body) > 0.8 * forms.FLUTE_DEPTH * body.max()
    assert np.ptp(between(0.02, 0.03)) < 1e-6  # the foot is round


@pytest.mark.parametrize("make", ["ball", "disc"])
def test_solids_are_closed(forms, make):
    mesh = forms.ball_mesh(0.5) if make == "ball" else forms.disc_mesh("disc", 0.3, 0.2, 0.01)
    assert set(edges_and_their_faces(mesh).values()) == {2}
    exact = 4 / 3 * np.pi * 0.5**3 if make == "ball" else np.pi * 0.3**2 * 0.2
    assert volume(mesh) == pytest.approx(exact, rel=0.02)


def test_rounded_is_a_b_spline(forms):
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (2.0, 1.0))
    curve = forms.rounded(corners, pieces=4)
    assert curve[0].tolist() == [0, 0]
    assert curve[-1].tolist() == [2, 1]
    # through the middles of the sides, and tangent to them
    assert [1.0, 0.5] in curve.tolist()
    assert (np.diff(curve, axis=0) >= 0).all()
