# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes of the demo: a turned form that shows highlights, and what it stands on.

A form to judge materials by needs what a plain sphere lacks: a dome that shows the lights as they
are, a groove and a rim where highlights are narrow and reflections meet, flutes whose curvature
changes along them, and a waist in which the form sees itself. It has no UV map: tangents of
anisotropic materials run around its axis, as on a lathe.
"""

from __future__ import annotations

import bpy
import numpy as np

# Control points (radius, height) of the profile, from the foot to the top of the dome. Where three
# of them are close together the edge is sharp.
FORM_PROFILE = (
    (0.0, 0.0),
    (0.30, 0.0),
    (0.325, 0.0),
    (0.335, 0.012),
    (0.335, 0.04),
    (0.325, 0.052),
    (0.285, 0.06),
    (0.205, 0.11),
    (0.22, 0.20),
    (0.38, 0.29),
    (0.525, 0.45),
    (0.545, 0.66),
    (0.46, 0.80),
    (0.405, 0.825),
    (0.40, 0.842),
    (0.42, 0.856),
    (0.485, 0.864),
    (0.505, 0.872),
    (0.505, 0.908),
    (0.485, 0.918),
    (0.43, 0.922),
    (0.415, 0.914),
    (0.405, 0.888),
    (0.39, 0.884),
    (0.375, 0.896),
    (0.37, 0.94),
    (0.355, 1.04),
    (0.27, 1.16),
    (0.13, 1.225),
    (0.0, 1.235),
)
SIDES = 144

# Flutes wind around the body between these heights.
FLUTES = 9
FLUTE_DEPTH = 0.12
FLUTE_TWIST = 1.1  # radians from the lower end to the upper
FLUTED = (0.18, 0.81)

# Pieces of the profile's curve to each of its control points.
PIECES = 3


def form_mesh() -> bpy.types.Mesh:
    """The turned form, standing on the origin: about 1.1 wide and 1.2 high."""
    profile = rounded(FORM_PROFILE)
    radius, height = profile[:, :1], profile[:, 1:]
    along = np.clip((height - FLUTED[0]) / (FLUTED[1] - FLUTED[0]), 0, 1)
    # round ridges, narrow valleys; none at either end
    start = np.arange(SIDES) / SIDES * 2 * np.pi
    valley = 1 - np.sqrt(np.sin(FLUTES / 2 * start) ** 2 + 0.01)
    radius = radius * (1 - FLUTE_DEPTH * np.sin(np.pi * along) ** 1.5 * np.maximum(valley, 0))
    # edges of the mesh run along the flutes, or these would be ragged
    phi = start - FLUTE_TWIST * along
    return turned("Form", radius, height, phi)


def disc_mesh(name: str, radius: float, height: float, edge: float) -> bpy.types.Mesh:
    """A round plate with a rounded upper edge, standing on the origin."""
    profile = rounded(
        (
            (0.0, 0.0),
            (radius, 0.0),
            (radius, 0.0),
            (radius, height - edge),
            (radius, height),
            (radius - edge, height),
            (0.0, height),
        )
    )
    return turned(name, profile[:, :1], profile[:, 1:], np.arange(SIDES) / SIDES * 2 * np.pi)


def ball_mesh(radius: float) -> bpy.types.Mesh:
    """A ball around the origin."""
    theta = np.linspace(np.pi, 0, 34)[:, None]
    phi = np.arange(64) / 64 * 2 * np.pi
    return turned("Ball", radius * np.sin(theta), radius * np.cos(theta), phi)


def extruded_mesh(name: str, profile: np.ndarray, width: float) -> bpy.types.Mesh:
    """A profile (n, 2) of (y, z), drawn along x."""
    n = len(profile)
    vertices = [(x, y, z) for x in (-width / 2, width / 2) for y, z in profile]
    faces = [(i, n + i, n + i + 1, i + 1) for i in range(n - 1)]
    return _mesh(name, vertices, faces)


def turned(name: str, radius: np.ndarray, height: np.ndarray, phi: np.ndarray) -> bpy.types.Mesh:
    """A closed mesh of rings one above the other, of which the first and last are points.

    radius, height, phi : metres, metres, radians; arrays that broadcast to (rings, sides)
    """
    rings = np.stack(np.broadcast_arrays(radius * np.cos(phi), radius * np.sin(phi), height), -1)
    bottom, rings, top = rings[0, 0], rings[1:-1], rings[-1, 0]
    n, sides = rings.shape[:2]
    corner = np.arange(n * sides).reshape(n, sides)
    beside = np.roll(corner, -1, axis=1)
    quads = np.stack([corner[:-1], beside[:-1], beside[1:], corner[1:]], -1).reshape(-1, 4)
    low, high = n * sides, n * sides + 1
    fans = [(low, b, a) for a, b in zip(corner[0].tolist(), beside[0].tolist(), strict=True)]
    fans += [(high, a, b) for a, b in zip(corner[-1].tolist(), beside[-1].tolist(), strict=True)]
    vertices = [*rings.reshape(-1, 3).tolist(), (0, 0, bottom[2]), (0, 0, top[2])]
    return _mesh(name, vertices, [*quads.tolist(), *fans])


def rounded(points: object, pieces: int = PIECES) -> np.ndarray:
    """The uniform quadratic B-spline of control points (n, 2), from the first to the last."""
    points = np.asarray(points, dtype=np.float64)
    middles = (points[1:] + points[:-1]) / 2
    t = np.arange(pieces)[:, None] / pieces
    curve = [points[:1]]
    for start, corner, end in zip(middles[:-1], points[1:-1], middles[1:], strict=True):
        curve.append((1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end)
    curve += [middles[-1:], points[-1:]]
    return np.concatenate(curve)


def _mesh(name: str, vertices: list, faces: list) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.shade_smooth()
    return mesh
