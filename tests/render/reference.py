"""Light transport in numpy: estimators that share nothing with Cycles or the shader.

Standard sphere: rays through random points of each pixel hit it exactly; light directions come from
a mixture of a cosine lobe and GGX-like half vectors of several widths, weighted by its density.
"""

import numpy as np

CAMERA_WIDTH = 2.2
ALPHAS = (0.01, 0.03, 0.1, 0.3, 0.8)


def environment_radiance(image, directions):
    """Bilinear look-up of (h, w, 3), top row first, in Blender's equirectangular orientation."""
    height, width = image.shape[:2]
    u = 0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)
    v = np.arccos(np.clip(directions[:, 2], -1, 1)) / np.pi
    x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), height - 2)
    s, t = (x - left)[:, None], (y - top)[:, None]
    rows, columns = (top, top + 1), (left % width, (left + 1) % width)
    upper = image[rows[0], columns[0]] * (1 - s) + image[rows[0], columns[1]] * s
    lower = image[rows[1], columns[0]] * (1 - s) + image[rows[1], columns[1]] * s
    return upper * (1 - t) + lower * t


def render(model, image, resolution, samples, rng):
    """Radiance (resolution, resolution, 3) of the sphere; where a ray misses, the environment."""
    total = np.zeros((resolution, resolution, 3))
    for _ in range(samples):
        column, row = np.meshgrid(np.arange(resolution), np.arange(resolution))
        x = ((column + rng.random(column.shape)) / resolution - 0.5) * CAMERA_WIDTH
        z = (0.5 - (row + rng.random(row.shape)) / resolution) * CAMERA_WIDTH
        inside = x * x + z * z < 1
        value = np.broadcast_to(
            environment_radiance(image, np.array([[0.0, 1.0, 0.0]])), (*x.shape, 3)
        ).copy()
        x, z = x[inside], z[inside]
        value[inside] = _radiance(
            model, image, np.stack([x, -np.sqrt(1 - x * x - z * z), z], -1), rng
        )
        total += value
    return total / samples


def _radiance(model, image, normals, rng):
    frame = frames(normals)
    value = np.zeros((len(normals), 3))
    world, weight, above = scatter(model, frame, np.array([0.0, -1.0, 0.0]), rng)
    value[above] = weight[above] * environment_radiance(image, world[above])
    return value


def frames(normals):
    """Local frames (n, 3, 3), rows tangent, bitangent, normal, of unit normals (n, 3).

    The tangent is the direction of increasing longitude about +Z.
    """
    tangent = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))], 1)
    tangent[np.hypot(*tangent.T[:2]) < 1e-6] = [1, 0, 0]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.stack([tangent, np.cross(normals, tangent), normals], 1)


def scatter(model, frame, view, rng):
    """One light direction for each frame (n, 3, 3) seen from `view` (3,) or (n, 3).

    Returns the directions in the world (n, 3), f cos / pdf (n, 3) and a mask of those above the
    horizon, the only ones for which the others mean anything.
    """
    wo = np.einsum("nij,nj->ni", frame, np.broadcast_to(view, (len(frame), 3)))
    wi = _sample(wo, rng)
    density = _density(wi, wo)
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0) & (density > 0)
    weight = np.zeros((len(frame), 3))
    f_r = model.f_r(wi[above], wo[above])
    weight[above] = f_r * (wi[above, 2] / density[above])[:, None]
    return np.einsum("nij,ni->nj", frame, wi), weight, above


def _sample(wo, rng):
    count = len(wo)
    phi = rng.uniform(0, 2 * np.pi, count)
    u = rng.random(count)
    choice = rng.integers(0, len(ALPHAS) + 1, count)
    alpha = np.array([*ALPHAS, 1.0])[choice]
    tan_h = alpha * np.sqrt(u / (1 - u))
    cos_h = 1 / np.sqrt(1 + tan_h**2)
    h = np.stack([tan_h * cos_h * np.cos(phi), tan_h * cos_h * np.sin(phi), cos_h], -1)
    mirrored = 2 * (h * wo).sum(1, keepdims=True) * h - wo
    sin_i = np.sqrt(u)
    cosine = np.stack([sin_i * np.cos(phi), sin_i * np.sin(phi), np.sqrt(1 - u)], -1)
    return np.where((choice == len(ALPHAS))[:, None], cosine, mirrored)


def _density(wi, wo):
    h = wi + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    cos_h = np.clip(h[:, 2], 0, 1)
    cos_d = np.maximum((h * wo).sum(1), 1e-12)
    lobes = sum(
        a**2 / (np.pi * (cos_h**2 * (a**2 - 1) + 1) ** 2) * cos_h / (4 * cos_d) for a in ALPHAS
    )
    return (lobes + np.maximum(wi[:, 2], 0) / np.pi) / (len(ALPHAS) + 1)
