# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from compare import mesh
from fitter.errors import NfmError

# Two triangles that make the square from (-1, -1) to (1, 1).
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def ply(vertices, faces):
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(vertices)}",
        "property float x",
        "property float y",
        "property float z",
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
        *(" ".join(map(str, v)) for v in vertices),
        *(" ".join(map(str, [len(f), *f])) for f in faces),
    ]
    return "\n".join(lines) + "\n"


def globe(n=48):
    """Vertices and triangles of a unit sphere, seen from outside."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, 2 * n + 1), indexing="ij"
    )
    vertices = np.stack(
        [np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1
    ).reshape(-1, 3)
    row, column = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(2 * n), indexing="ij"))
    a = row * (2 * n + 1) + column
    b = a + 2 * n + 1
    faces = np.concatenate([np.stack([a, b, a + 1], 1), np.stack([b, b + 1, a + 1], 1)])
    return vertices, faces


def test_reads_what_was_written(tmp_path):
    path = tmp_path / "square.ply"
    path.write_text(ply(SQUARE, FACES))
    vertices, faces = mesh.read_ply(path)
    np.testing.assert_array_equal(vertices, SQUARE)
    np.testing.assert_array_equal(faces, FACES)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "ply\nend_header\n",
        ply(SQUARE, FACES)[:-20],
        ply(SQUARE, [[0, 1, 2, 3]]),
        ply(SQUARE, [[0, 1, 4]]),
        ply(SQUARE, [[0, 1, -1]]),
        ply(SQUARE, FACES).replace("-1", "x", 1),
        "ply\x80",
    ],
)
def test_anything_else_is_an_error_that_names_the_file(tmp_path, text):
    path = tmp_path / "broken.ply"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(NfmError, match=r"^broken\.ply: "):
        mesh.read_ply(path)
    with pytest.raises(NfmError, match=r"^none\.ply: "):
        mesh.read_ply(tmp_path / "none.ply")


def test_globe_looks_like_a_sphere():
    normals, mask = mesh.visible_normals(*globe(), 50)
    pixel = 2 / (50 * (1 - 2 * mesh.MARGIN))
    row, column = np.nonzero(mask)
    x = (column - (mask.shape[1] - 1) / 2) * pixel
    y = ((mask.shape[0] - 1) / 2 - row) * pixel
    assert mask.sum() * pixel**2 == pytest.approx(np.pi, rel=0.01)
    inner = np.hypot(x, y) < 0.95
    expected = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], -1)
    np.testing.assert_allclose(normals[inner], expected[inner], atol=0.01)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-12)


def test_what_is_nearest_is_seen():
    tilted = SQUARE * [0.5, 0.5, 1] + [0, 0, 1]
    tilted[:, 2] += tilted[:, 0]  # its normal leans to -x
    vertices = np.concatenate([tilted, SQUARE])
    for faces in (np.concatenate([FACES, FACES + 4]), np.concatenate([FACES + 4, FACES])):
        normals, mask = mesh.visible_normals(vertices, faces, 40)
        image = np.full((*mask.shape, 3), np.nan)
        image[mask] = normals
        leaning = np.array([-1, 0, 1]) / np.sqrt(2)
        np.testing.assert_allclose(image[20, 20], leaning, atol=1e-12)
        np.testing.assert_allclose(image[5, 20], [0, 0, 1], atol=1e-12)
        assert np.isnan(image[0, 0]).all()


def test_up_is_up():
    """A floor that leans back is seen below a wall."""
    vertices = np.array([[-1, -1, 1], [1, -1, 1], [1, 0, 0], [-1, 0, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    wall = np.array([[3, 2, 4], [3, 4, 5]])
    only_floor, mask = mesh.visible_normals(vertices, np.concatenate([faces, wall]), 40)
    image = np.zeros((*mask.shape, 3))
    image[mask] = only_floor
    assert image[36, 20, 1] > 0.5
    assert image[3, 20, 1] < 0.1


def test_no_normal_faces_away():
    vertices, faces = globe(6)  # so coarse that interpolation turns normals at the outline
    rng = np.random.default_rng(0)
    jagged = vertices * rng.uniform(0.6, 1.4, (len(vertices), 1))
    normals, _ = mesh.visible_normals(jagged, faces, 60)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-9)
    assert normals[:, 2].min() >= mesh.SMALLEST_COS_O * (1 - 1e-9)
    assert (normals[:, 2] < 0.03).any()
    # seen from behind it is the same shape
    inside_out, _ = mesh.visible_normals(vertices, faces[:, ::-1], 60)
    assert inside_out[:, 2].mean() > 0.5
