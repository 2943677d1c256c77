# SPDX-License-Identifier: GPL-3.0-or-later
"""What the standard sphere under a light of lights.py must look like: the model in numpy.

Shares nothing with Cycles or the shaders. Every block of the picture is an integral over its area
and over directions, by multiple importance sampling: half the directions are drawn from the light,
half from the D of the model's lobes and a cosine lobe, and weighted with the density of the whole
mixture (balance heuristic). The points are a Halton sequence, turned by a random shift for each
block, so that two calls give independent results whose difference is the error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fitter.geometry import normalized
from fitter.models.factors import Factors
from fitter.models.tables import SamplingTables, sampling_tables, versine_nodes
from fitter.shading.stand_in import without_direction

from .lights import LAMP_POSITION, LAMP_WATTS, Light

# Across the block (2), the direction (2), which part of the mixture. The last one halves the points
# between light and lobes, hence base 2; a Kronecker sequence does that badly (4 x the error).
BASES = (7, 11, 3, 5, 2)
DIMENSIONS = len(BASES)
AT_ONCE = 1 << 16  # points
VIEW = np.array([0.0, -1.0, 0.0])  # to the camera


class Source(Protocol):
    """A light to integrate, seen from points (n, 3) of the sphere."""

    def draw(self, points: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Unit directions (n, 3) for u (n, 2)."""

    def density(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Density (n,) of draw, 1/sr."""

    def radiance(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Radiance (n, 1) or (n, 3)."""


@dataclass(frozen=True)
class Blocks:
    """Square blocks of the picture: middles x, z (n,) and side, in units of the sphere's radius."""

    x: np.ndarray
    z: np.ndarray
    side: float


def expected_picture(
    model: Factors, source: Source, blocks: Blocks, samples: int, rng: np.random.Generator
) -> np.ndarray:
    """Mean radiance (n, 3) of the blocks."""
    # directions may be drawn as if D had none: the density is what they were drawn from
    tables = sampling_tables(without_direction(model))
    out = np.zeros((len(blocks.x), 3))
    steps = _halton(samples)
    shifts = rng.random((len(blocks.x), 1, DIMENSIONS))
    rows = max(AT_ONCE // samples, 1)
    for first in range(0, len(blocks.x), rows):
        part = slice(first, first + rows)
        u = ((steps + shifts[part]) % 1).reshape(-1, DIMENSIONS)
        x = np.repeat(blocks.x[part], samples) + (u[:, 0] - 0.5) * blocks.side
        z = np.repeat(blocks.z[part], samples) + (u[:, 1] - 0.5) * blocks.side
        points = np.stack([x, -np.sqrt(np.maximum(1 - x**2 - z**2, 0)), z], -1)
        value = _reflected(model, tables, source, points, u[:, 2:])
        out[part] = value.reshape(-1, samples, 3).mean(1)
    return out


def source_of(light: Light, image: np.ndarray | None) -> Source:
    """The source of a light; image is its map (h, w, 3), if it has one."""
    if image is not None:
        return Environment(image)
    if light.lamp == "area":
        return SquareLamp(light.size)
    return SphereLamp(light.size) if light.size else PointLamp()


def _reflected(
    model: Factors,
    tables: SamplingTables,
    source: Source,
    points: np.ndarray,
    u: np.ndarray,
) -> np.ndarray:
    """One estimate (n, 3) of the radiance towards the camera for each point of the sphere."""
    frame = _frames(points)
    wo = frame @ VIEW
    if isinstance(source, PointLamp):
        world = source.draw(points, u)
        wi, weight = np.einsum("nij,nj->ni", frame, world), source.intensity(points)
    else:
        from_source = u[:, 2] < 0.5
        parts = len(tables.density) + 1
        choice = np.minimum((u[:, 2] * 2 % 1 * parts).astype(int), parts - 1)
        wi = _draw_lobes(tables, wo, u, choice)
        world = np.einsum("nij,ni->nj", frame, wi)
        world[from_source] = source.draw(points[from_source], u[from_source, :2])
        wi[from_source] = np.einsum("nij,nj->ni", frame[from_source], world[from_source])
        density = source.density(points, world) / 2 + _lobe_density(tables, wi, wo) / 2
        weight = source.radiance(points, world) / np.maximum(density, 1e-30)[:, None]
    value = np.zeros((len(u), 3))
    lit = np.flatnonzero((wi[:, 2] > 0) & (weight.max(1) > 0))
    value[lit] = model.f_r(wi[lit], wo[lit]) * wi[lit, 2:] * weight[lit]
    return value


class PointLamp:
    """A lamp of zero radius: one direction, to be weighted with its intensity."""

    def draw(self, points: np.ndarray, _u: np.ndarray) -> np.ndarray:
        """Directions (n, 3) to the lamp."""
        return normalized(np.array(LAMP_POSITION) - points)

    def intensity(self, points: np.ndarray) -> np.ndarray:
        """Irradiance (n, 1) across the direction to the lamp: P / (4 pi r^2)."""
        distance2 = ((np.array(LAMP_POSITION) - points) ** 2).sum(1, keepdims=True)
        return LAMP_WATTS / (4 * np.pi) / distance2


@dataclass(frozen=True)
class SphereLamp:
    """A sphere that radiates evenly."""

    radius: float

    def draw(self, points: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Uniform in the cone that the sphere fills."""
        axis, versine = self._cone(points)
        right = normalized(np.cross(axis, [0.0, 0.0, 1.0]))
        part = versine * u[:, 0]
        sine, phi = np.sqrt(part * (2 - part)), 2 * np.pi * u[:, 1]
        return (
            (1 - part)[:, None] * axis
            + (sine * np.cos(phi))[:, None] * right
            + (sine * np.sin(phi))[:, None] * np.cross(right, axis)
        )

    def density(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """1 / solid angle inside the cone."""
        axis, versine = self._cone(points)
        # |a - b|^2 / 2 = 1 - a.b, without cancellation
        inside = ((directions - axis) ** 2).sum(1) / 2 <= versine * (1 + 1e-9)
        return inside / (2 * np.pi * versine)

    def radiance(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Power / (pi * surface)."""
        lit = self.density(points, directions) > 0
        return lit[:, None] * LAMP_WATTS / (4 * np.pi**2 * self.radius**2)

    def _cone(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Axis (n, 3) and 1 - cos of the half angle (n,)."""
        towards = np.array(LAMP_POSITION) - points
        sin2 = self.radius**2 / (towards**2).sum(1)
        return normalized(towards), sin2 / (1 + np.sqrt(1 - sin2))


@dataclass(frozen=True)
class SquareLamp:
    """A square that faces the origin and radiates evenly on that side."""

    side: float

    def draw(self, points: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Uniform over the square."""
        right, up, _ = self._axes()
        offset = (u - 0.5) * self.side
        on_lamp = np.array(LAMP_POSITION) + offset[:, :1] * right + offset[:, 1:] * up
        return normalized(on_lamp - points)

    def density(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """distance^2 / (area cos) where a direction meets the square."""
        right, up, facing = self._axes()
        cosine = -directions @ facing
        ahead = np.where(cosine > 1e-6, cosine, np.inf)
        distance = (np.array(LAMP_POSITION) - points) @ -facing / ahead
        offset = points + distance[:, None] * directions - LAMP_POSITION
        half = self.side / 2 * (1 + 1e-9)
        inside = (np.abs(offset @ right) <= half) & (np.abs(offset @ up) <= half)
        return np.where(inside, distance**2 / (self.side**2 * ahead), 0)

    def radiance(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Power / (pi * surface)."""
        lit = self.density(points, directions) > 0
        return lit[:, None] * LAMP_WATTS / (np.pi * self.side**2)

    def _axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        facing = -normalized(np.array(LAMP_POSITION))
        right = normalized(np.cross(facing, [0.0, 0.0, 1.0]))
        return right, np.cross(right, facing), facing


@dataclass
class Environment:
    """A map (h, w, 3), top row first, as Blender wraps it around the scene."""

    image: np.ndarray

    def __post_init__(self) -> None:
        """Importance of the texels: their light and, for bilinear edges, their neighbours'."""
        height, width = self.image.shape[:2]
        light = self.image.astype(np.float64).mean(-1)
        light = sum(np.roll(light, shift, 1) for shift in (-1, 0, 1))
        light = sum(np.roll(light, shift, 0) for shift in (-1, 0, 1))
        self._cosines = np.cos(np.arange(height + 1) / height * np.pi)
        solid_angle = -np.diff(self._cosines) * 2 * np.pi / width
        share = light * solid_angle[:, None]
        self._density = (share / share.sum() / solid_angle[:, None]).ravel()
        self._cumulative = np.cumsum(share.ravel()) / share.sum()

    def radiance(self, _points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Bilinear look-up (n, 3)."""
        height, width = self.image.shape[:2]
        u, v = self._position(directions)
        x, y = u * width - 0.5, np.clip(v * height - 0.5, 0, height - 1)
        left, top = np.floor(x).astype(int), np.minimum(y.astype(int), height - 2)
        s, t = (x - left)[:, None], (y - top)[:, None]
        right, left = (left + 1) % width, left % width
        upper = self.image[top, left] * (1 - s) + self.image[top, right] * s
        lower = self.image[top + 1, left] * (1 - s) + self.image[top + 1, right] * s
        return upper * (1 - t) + lower * t

    def density(self, _points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Share of the texel / its solid angle."""
        return self._density[self._texel(directions)]

    def draw(self, _points: np.ndarray, u: np.ndarray) -> np.ndarray:
        """A texel in proportion to its importance, evenly inside it."""
        height, width = self.image.shape[:2]
        texel = np.minimum(np.searchsorted(self._cumulative, u[:, 0], "right"), height * width - 1)
        before = np.where(texel > 0, self._cumulative[texel - 1], 0)
        within = np.clip((u[:, 0] - before) / (self._cumulative[texel] - before), 0, 1)
        row, column = np.divmod(texel, width)
        phi = (0.5 - (column + within) / width) * 2 * np.pi
        cosine = self._cosines[row] * (1 - u[:, 1]) + self._cosines[row + 1] * u[:, 1]
        sine = np.sqrt(1 - cosine**2)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], -1)

    def _texel(self, directions: np.ndarray) -> np.ndarray:
        height, width = self.image.shape[:2]
        u, v = self._position(directions)
        column = np.minimum((u * width).astype(int), width - 1)
        return np.minimum((v * height).astype(int), height - 1) * width + column

    @staticmethod
    def _position(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = 0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)
        return u, np.arccos(np.clip(directions[:, 2], -1, 1)) / np.pi


def _halton(count: int) -> np.ndarray:
    """Points (count, DIMENSIONS): digits of the index in each base, mirrored at the point."""
    out = np.zeros((count, DIMENSIONS))
    for column, base in enumerate(BASES):
        rest, place = np.arange(count), 1 / base
        while rest.any():
            out[:, column] += rest % base * place
            rest, place = rest // base, place / base
    return out


def _frames(normals: np.ndarray) -> np.ndarray:
    """Rows tangent, bitangent, normal: (n, 3, 3); the tangent is increasing longitude about +Z."""
    helper = np.where(np.abs(normals[:, 2:]) < 1 - 1e-9, [[0, 0, 1.0]], [[0, 1.0, 0]])
    tangent = normalized(np.cross(helper, normals))
    return np.stack([tangent, np.cross(normals, tangent), normals], 1)


def _draw_lobes(
    tables: SamplingTables, wo: np.ndarray, u: np.ndarray, choice: np.ndarray
) -> np.ndarray:
    """Directions (n, 3): mirrored at a half vector of lobe `choice`, or the cosine lobe last."""
    versine = 1 - np.sqrt(1 - u[:, 0])
    for lobe, (density, cumulative) in enumerate(
        zip(tables.density, tables.cumulative, strict=True)
    ):
        drawn = choice == lobe
        versine[drawn] = _invert(density, cumulative, u[drawn, 0])
    sine, phi = np.sqrt(versine * (2 - versine)), 2 * np.pi * u[:, 1]
    drawn = np.stack([sine * np.cos(phi), sine * np.sin(phi), 1 - versine], -1)
    mirrored = 2 * (drawn * wo).sum(1, keepdims=True) * drawn - wo
    return np.where((choice == len(tables.density))[:, None], drawn, mirrored)


def _invert(density: np.ndarray, cumulative: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Versine v whose cumulative density is u; the density is linear in v between nodes."""
    nodes = versine_nodes()
    node = np.clip(np.searchsorted(cumulative, u, "right") - 1, 0, len(nodes) - 2)
    left, right = density[node], density[node + 1]
    width = nodes[node + 1] - nodes[node]
    rest = np.maximum(u - cumulative[node], 0) / (2 * np.pi * width)
    root = np.sqrt(left**2 + 2 * (right - left) * rest)
    t = 2 * rest / np.maximum(left + root, 1e-300)
    return nodes[node] + np.clip(t, 0, 1) * width


def _lobe_density(tables: SamplingTables, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Density (n,) of _draw_lobes with an even choice, 1/sr."""
    h = normalized(wi + wo)
    cos_d = np.maximum((h * wo).sum(1), 1e-12)
    sin2 = h[:, 0] ** 2 + h[:, 1] ** 2
    versine = np.where(h[:, 2] > 0, sin2 / (1 + np.sqrt(np.maximum(1 - sin2, 0))), 1)
    lobes = sum(np.interp(versine, versine_nodes(), density) for density in tables.density)
    cosine = np.maximum(wi[:, 2], 0) / np.pi
    return (lobes / (4 * cos_d) + cosine) / (len(tables.density) + 1)
