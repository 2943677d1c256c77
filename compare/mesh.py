# SPDX-License-Identifier: GPL-3.0-or-later
"""Which points of a mesh a camera sees: one ray through each pixel's centre, in numpy.

The view is orthographic along -z with +y up, as that of fitter/pictures/sphere.py, so that a ray
hits a triangle where the pixel's centre lies inside its outline. Shading normals are interpolated
from the vertices, as a renderer's smooth shading does.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from fitter.errors import NfmError, shown_name
from fitter.geometry import normalized

# Space between the mesh and the edge of the picture, as a share of its height.
MARGIN = 0.02

# A shading normal may not face away from the viewer: at the outline of a coarse mesh
# interpolation can turn it by that much. cos theta_o of what is then taken instead.
SMALLEST_COS_O = 0.02


def read_ply(path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and triangles (m, 3) of an ascii PLY file.

    Raises
    ------
    NfmError
        The file cannot be read, or is not an ascii PLY of triangles.
    """
    name = shown_name(path)
    try:
        header, _, body = Path(path).read_text(encoding="ascii").partition("end_header\n")
        counts = {}
        for line in header.splitlines():
            words = line.split()
            if words[:1] == ["element"]:
                counts[words[1]] = int(words[2])
        lines = body.splitlines()
        n, m = counts["vertex"], counts["face"]
        vertices = np.array([line.split()[:3] for line in lines[:n]], dtype=np.float64)
        faces = np.array([line.split() for line in lines[n : n + m]], dtype=np.intp)
        if vertices.shape != (n, 3) or faces.shape != (m, 4) or (faces[:, 0] != 3).any():
            raise ValueError("not only triangles")
        if faces[:, 1:].min() < 0 or faces[:, 1:].max() >= n:
            raise ValueError("a triangle names a vertex that is not there")
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise NfmError(f"{name}: cannot be read as an ascii PLY of triangles ({error})") from None
    return vertices, faces[:, 1:]


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3): those of the triangles around a vertex, weighted by their areas."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    twice_area = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], twice_area)
    return normalized(normals)


def visible_normals(
    vertices: np.ndarray, faces: np.ndarray, height: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shading normals (n, 3) of the pixels in the mask, and the mask (height, width), row by row.

    The mesh fills the height; the width follows. What is nearest to the viewer, at +z, is seen.
    """
    low, high = vertices[:, :2].min(0), vertices[:, :2].max(0)
    pixel = (high[1] - low[1]) / (height * (1 - 2 * MARGIN))
    width = int(np.ceil((high[0] - low[0]) / pixel + 2 * MARGIN * height))
    # positions in pixels, y down; pixel (row, column) has its centre at integers
    centre = (low + high) / 2
    x = (vertices[:, 0] - centre[0]) / pixel + (width - 1) / 2
    y = (centre[1] - vertices[:, 1]) / pixel + (height - 1) / 2

    triangle, row, column, share = _covered_pixels(x[faces], y[faces])
    depth = (share * vertices[faces[triangle], 2]).sum(1)
    index = row * width + column
    # the last of equal pixels is the nearest
    order = np.lexsort((depth, index))
    nearest = order[np.append(np.diff(index[order]) > 0, True)]
    normals = vertex_normals(vertices, faces)[faces[triangle[nearest]]]
    mask = np.zeros(height * width, bool)
    mask[index[nearest]] = True
    return _facing(normalized((share[nearest, :, None] * normals).sum(1))), mask.reshape(height, -1)


def _covered_pixels(
    x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """All pairs of a triangle and a pixel whose centre it covers.

    x, y : (m, 3) corners in pixels
    returns triangle, row, column (k,) and the shares (k, 3) of its corners
    """
    left, top = np.ceil(x.min(1)).astype(np.intp), np.ceil(y.min(1)).astype(np.intp)
    columns = np.floor(x.max(1)).astype(np.intp) - left + 1
    rows = np.floor(y.max(1)).astype(np.intp) - top + 1
    area = _cross(x[:, 1] - x[:, 0], y[:, 1] - y[:, 0], x[:, 2] - x[:, 0], y[:, 2] - y[:, 0])
    # the triangle of each pixel of all bounding boxes, and the pixel's place in its box
    counts = np.where(area != 0, np.maximum(rows, 0) * np.maximum(columns, 0), 0)
    triangle = np.repeat(np.arange(len(x)), counts)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = top[triangle] + place // columns[triangle], left[triangle]
    column = column + place % columns[triangle]

    corner_x, corner_y = x[triangle] - column[:, None], y[triangle] - row[:, None]
    share = np.empty((len(triangle), 3))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        share[:, k] = _cross(corner_x[:, i], corner_y[:, i], corner_x[:, j], corner_y[:, j])
    share /= area[triangle, None]
    inside = (share >= 0).all(1)
    return triangle[inside], row[inside], column[inside], share[inside]


def _cross(ax: np.ndarray, ay: np.ndarray, bx: np.ndarray, by: np.ndarray) -> np.ndarray:
    return ax * by - ay * bx


def _facing(normals: np.ndarray) -> np.ndarray:
    """Normals turned as far as it takes to face the viewer."""
    # a triangle seen from behind: the mesh is not clean
    normals = np.where(normals[:, 2:] < -0.5, -normals, normals)
    grazing = normals[:, 2] < SMALLEST_COS_O
    sideways = normalized(normals[:, :2]) * np.sqrt(1 - SMALLEST_COS_O**2)
    turned = np.column_stack([sideways, np.full(len(normals), SMALLEST_COS_O)])
    return np.where(grazing[:, None], turned, normals)
