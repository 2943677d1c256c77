# SPDX-License-Identifier: GPL-3.0-or-later
"""A square of cloth that falls over a ball: a small simulation, the same on every run.

Position-based dynamics (Mueller, Heidelberger, Hennix, Ratcliff 2007): particles on a grid fall,
and distances between neighbours are restored one group after another; within a group no two
distances share a particle, so each is one array operation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BALL_RADIUS = 0.55  # around the origin
SIDE = 2.3  # of the cloth
PARTICLES = 65  # along a side
START = 0.03  # how high above the ball the cloth is let go

# Coarse grids settle fast; each is the start of the next, twice as fine.
LEVELS = (17, 33, 65)
STEPS = (150, 90, 60)  # on each of them
SWEEPS = 10  # of the distances in each step
TIME_STEP = 1 / 60
DRAG = 0.985  # what is left of the speed after a step
BENDING = 0.12  # how much of the distance to the next but one neighbour is restored
SHEARING = 0.35  # the same along the diagonals: cloth gives way there
FRICTION = 0.9  # share of the way along the ball that is taken back


@dataclass(frozen=True)
class Distances:
    """Pairs of particles that share none with each other.

    first, second : indices (n,)
    rest : length that they ought to have
    stiffness : share of the difference that is restored
    """

    first: np.ndarray
    second: np.ndarray
    rest: float
    stiffness: float


def draped_cloth() -> tuple[np.ndarray, np.ndarray]:
    """Positions (65, 65, 3) of a cloth on a ball around the origin, and UV coordinates (65, 65, 2).

    U and V run along the threads, from 0 to 1.
    """
    axis = (np.arange(LEVELS[0]) / (LEVELS[0] - 1) - 0.5) * SIDE
    x, y = np.meshgrid(axis, axis, indexing="ij")
    # a height that is not quite level lets folds choose a side
    position = np.stack([x, y, BALL_RADIUS + START + 0.01 * np.cos(5 * x) * np.sin(4 * y)], -1)
    for side, steps in zip(LEVELS, STEPS, strict=True):
        if len(position) < side:
            position = _refined(position)
        position = _settled(position, steps)
    u, v = np.meshgrid(*2 * (np.linspace(0, 1, PARTICLES),), indexing="ij")
    return position, np.stack([u, v], -1)


def _settled(position: np.ndarray, steps: int) -> np.ndarray:
    """The cloth (n, n, 3) after so many steps."""
    side = len(position)
    groups = _distances(side)
    here = position.reshape(-1, 3).copy()
    speed = np.zeros_like(here)
    fall = np.array([0, 0, -9.81]) * TIME_STEP
    for _ in range(steps):
        speed = DRAG * speed + fall
        before, here = here, here + speed * TIME_STEP
        for _ in range(SWEEPS):
            for group in groups:
                _restore(here, group)
            _push_out(here, before)
        speed = (here - before) / TIME_STEP
    return here.reshape(side, side, 3)


def _distances(side: int) -> list[Distances]:
    index = np.arange(side * side).reshape(side, side)
    step = SIDE / (side - 1)
    groups = []
    for (i, j), length, stiffness in (
        ((1, 0), step, 1.0),
        ((0, 1), step, 1.0),
        ((1, 1), step * np.sqrt(2), SHEARING),
        ((1, -1), step * np.sqrt(2), SHEARING),
        ((2, 0), 2 * step, BENDING),
        ((0, 2), 2 * step, BENDING),
    ):
        stride = max(i, j)
        first, second = _shifted(index, i, j)
        along = np.arange(len(first))[:, None] if i else np.arange(first.shape[1])[None, :]
        phase = np.broadcast_to(along // stride % 2, first.shape)
        groups += [
            Distances(first[phase == p], second[phase == p], length, stiffness) for p in (0, 1)
        ]
    return groups


def _shifted(index: np.ndarray, i: int, j: int) -> tuple[np.ndarray, np.ndarray]:
    """Particles that have a neighbour i rows and j columns on, and these neighbours."""
    rows, columns = len(index) - i, index.shape[1] - abs(j)
    first = index[:rows, max(-j, 0) : max(-j, 0) + columns]
    second = index[i:, max(j, 0) : max(j, 0) + columns]
    return first, second


def _restore(position: np.ndarray, group: Distances) -> None:
    apart = position[group.second] - position[group.first]
    length = np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)
    move = apart * (group.stiffness * (length - group.rest) / (2 * length))
    position[group.first] += move
    position[group.second] -= move


def _push_out(position: np.ndarray, before: np.ndarray) -> None:
    """Particles in the ball go to its surface, and hardly slide on it."""
    distance = np.linalg.norm(position, axis=1)
    inside = distance < BALL_RADIUS
    outward = position[inside] / np.maximum(distance[inside], 1e-9)[:, None]
    on_ball = outward * BALL_RADIUS
    way = on_ball - before[inside]
    slide = way - outward * (way * outward).sum(1, keepdims=True)
    position[inside] = on_ball - FRICTION * slide


def _refined(position: np.ndarray) -> np.ndarray:
    """Twice as many particles along each side (2 n - 1), new ones in the middle of the old."""
    for axis in (0, 1):
        position = np.moveaxis(position, axis, 0)
        finer = np.empty((2 * len(position) - 1, *position.shape[1:]))
        finer[::2] = position
        finer[1::2] = (position[1:] + position[:-1]) / 2
        position = np.moveaxis(finer, 0, axis)
    return position
