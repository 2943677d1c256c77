# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact pictures under an environment map, to grade a fit by what it looks like.

Protocol (docs/RESULTS.md): orthographic view of the unit sphere, 64 x 64 pixels with one ray
through each centre, environment box-filtered to 128 x 64 texels that are summed exactly, tables
looked up at the nearest bin. No sampling, so no noise: what differs is the BRDF.
"""

from __future__ import annotations

import numpy as np

from ..geometry import N_PHI_D, N_THETA_D, N_THETA_H, merl_bin_index, normalized

RESOLUTION = 64
ENVIRONMENT_SHAPE = (64, 128)

# Bounds the memory of a render: 16 MB for each array over pixels and texels.
PIXELS_AT_ONCE = 512

# Pixels of the lit sphere, sRGB-like display: exposure so that the reference's mean is EXPOSURE.
EXPOSURE = 0.3
DISPLAY_GAMMA = 2.2


class Scene:
    """Pixels with something in them, seen along -z with +y up, under environment maps.

    A map's poles are +-y, its columns run from +x to +z. Direct light without shadows.

    mask : (height, width)
    directions : (k, 3) unit, to the texels of a map
    solid_angle : (k,) of the texels, sr
    light : (environments, k, 3) radiance times solid angle of the texels
    """

    def __init__(self, mask: np.ndarray, environments: list[np.ndarray]) -> None:
        rows, columns = ENVIRONMENT_SHAPE
        theta = (np.arange(rows) + 0.5) / rows * np.pi
        self.directions = texel_directions()
        texel = np.sin(theta) * (np.pi / rows) * (2 * np.pi / columns)
        self.solid_angle = np.repeat(texel, columns)
        self.light = np.stack(
            [
                box_filtered(image, rows, columns).reshape(-1, 3) * self.solid_angle[:, None]
                for image in environments
            ]
        ).astype(np.float32)
        self.mask = mask

    def picture(self, pixels: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Display picture (height, width, 3) in 0..1 of one environment's pixels."""
        image = np.zeros((*self.mask.shape, 3))
        image[self.mask] = display(pixels, reference)
        return image


class LitScene(Scene):
    """Visible points with normals, for isotropic materials.

    normals : (n, 3) unit, facing the viewer (+z), one for each pixel that is True in `mask`
    mask : (height, width)
    environments : list of (h, w, 3) radiance maps, row 0 at +y; h and w at least 64 and 128
    """

    def __init__(
        self, normals: np.ndarray, mask: np.ndarray, environments: list[np.ndarray]
    ) -> None:
        super().__init__(mask, environments)
        self.normals = normals
        self._bins = _table_look_ups(normals, self.directions)

    def render(self, f_r: np.ndarray) -> np.ndarray:
        """Linear pixels (environments, n_pixels, 3) of a table (90, 90, 180, 3) in 1/sr."""
        out = np.empty((len(self.light), len(self._bins), 3))
        tables = [np.append(f_r[..., c].ravel(), 0).astype(np.float32) for c in range(3)]
        for start in range(0, len(self._bins), PIXELS_AT_ONCE):
            rows = slice(start, start + PIXELS_AT_ONCE)
            cosines = (self.normals[rows] @ self.directions.T).astype(np.float32)
            for channel, table in enumerate(tables):
                reflected = table[self._bins[rows]] * cosines
                out[:, rows, channel] = self.light[..., channel] @ reflected.T
        return out


class SphereScene(LitScene):
    """The unit sphere; see LitScene."""

    def __init__(self, environments: list[np.ndarray], resolution: int = RESOLUTION) -> None:
        normals, mask = sphere_normals(resolution)
        super().__init__(normals, mask, environments)


def sphere_normals(resolution: int) -> tuple[np.ndarray, np.ndarray]:
    """Normals (n, 3) of the unit sphere at the centres of the pixels in the mask, and the mask."""
    axis = (np.arange(resolution) + 0.5) / resolution * 2 - 1
    x, y = np.meshgrid(axis, -axis)
    mask = x * x + y * y < 1
    x, y = x[mask], y[mask]
    return np.stack([x, y, np.sqrt(1 - x * x - y * y)], -1), mask


def display(pixels: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Display values 0..1 of linear pixels, exposed by the reference, gamma 2.2."""
    return np.clip(pixels * (EXPOSURE / reference.mean()), 0, 1) ** (1 / DISPLAY_GAMMA)


def rendered_psnr(pixels: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """PSNR in dB, peak 1, of display values; one for each environment (first axis)."""
    return np.array(
        [
            -10 * np.log10(max(np.mean((display(a, b) - display(b, b)) ** 2), 1e-12))
            for a, b in zip(pixels, reference, strict=True)
        ]
    )


def texel_directions() -> np.ndarray:
    """Unit directions (texels, 3) to the middles of a map's texels, row by row."""
    rows, columns = ENVIRONMENT_SHAPE
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    phi = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    return np.stack(
        np.broadcast_arrays(
            np.sin(theta)[:, None] * np.cos(phi),
            np.cos(theta)[:, None],
            np.sin(theta)[:, None] * np.sin(phi),
        ),
        -1,
    ).reshape(-1, 3)


def texel_index(directions: np.ndarray) -> np.ndarray:
    """Index (n,) of the texel that holds each unit direction (n, 3)."""
    rows, columns = ENVIRONMENT_SHAPE
    theta = np.arccos(np.clip(directions[:, 1], -1, 1))
    phi = np.mod(np.arctan2(directions[:, 2], directions[:, 0]), 2 * np.pi)
    row = np.minimum((theta / np.pi * rows).astype(np.intp), rows - 1)
    return row * columns + np.minimum((phi / (2 * np.pi) * columns).astype(np.intp), columns - 1)


def box_filtered(image: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Image (h, w, 3) averaged over whole boxes to (rows, columns, 3); a remainder is cut off."""
    height, width = image.shape[0] // rows, image.shape[1] // columns
    cropped = image[: rows * height, : columns * width]
    return cropped.reshape(rows, height, columns, width, 3).mean((1, 3))


def _table_look_ups(normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Flat table index (n_pixels, n_directions); past the end for light from below."""
    outside = N_THETA_H * N_THETA_D * N_PHI_D
    index = np.full((len(normals), len(directions)), outside, np.int32)
    for row, normal in enumerate(normals):
        lit = directions @ normal > 0
        frame = local_frame(normal)
        wi = directions[lit] @ frame.T
        # the viewer is at +z
        wo = np.broadcast_to(frame[:, 2], wi.shape)
        h, d, p = merl_bin_index(wi, wo)
        index[row, lit] = (h * N_THETA_D + d) * N_PHI_D + p
    return index


def local_frame(normal: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) that takes world directions to the frame of a normal; the normal becomes +z.

    Any tangent will do: the materials are isotropic.
    """
    aside = [0.0, 1.0, 0.0] if abs(normal[1]) < 0.999 else [1.0, 0.0, 0.0]
    tangent = normalized(np.cross(aside, normal))
    return np.stack([tangent, np.cross(normal, tangent), normal])
