"""Two surfaces light each other: two bounces against numpy."""

from functools import cache

import numpy as np
import pytest

from tests.models import MODELS
from tests.render import reference
from tests.render.samplings import SAMPLINGS
from tests.render.scenes import blocks, check_equal, render_seeds

RESOLUTION, BLOCK, WIDTH = 12, 4, 1.2
VIEW = np.array([0, -1, 1]) / np.sqrt(2)

# floor z = 0 and wall y = 0, which meet at the x axis: half widths along it, and depth
REACH = 1.0
NORMALS = np.array([[0, 0, 1.0], [0, -1.0, 0]])


def other_hit(points, directions, surface):
    """Where rays from floor (0) or wall (1), (n,), meet the other: points (n, 3) and a mask."""
    axis = np.where(surface == 0, 1, 2)  # the coordinate that is 0 on the other one
    rows = np.arange(len(points))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -points[rows, axis] / directions[rows, axis]
        hits = points + t[:, None] * directions
    height = np.where(surface == 0, hits[:, 2], -hits[:, 1])
    inside = (t > 0) & (height > 0) & (height < REACH) & (np.abs(hits[:, 0]) < REACH)
    return hits, inside


def picture(models, samples, rng):
    """The corner under white light, two bounces at most."""
    row, column = np.tile(np.indices((RESOLUTION, RESOLUTION)).reshape(2, -1), samples)
    offset = rng.random((2, row.size))
    x = ((column + offset[0]) / RESOLUTION - 0.5) * WIDTH
    # seen at 45 degrees: the upper half is the wall, the lower half the floor
    height = (0.5 - (row + offset[1]) / RESOLUTION) * WIDTH * np.sqrt(2)
    surface = (height > 0).astype(int)
    points = np.stack([x, np.minimum(height, 0), np.maximum(height, 0)], -1)
    radiance, throughput = np.zeros((row.size, 3)), np.ones((row.size, 3))
    alive, view = np.ones(row.size, bool), np.broadcast_to(VIEW, points.shape)
    for _ in range(2):
        frame = reference.frames(NORMALS[surface])
        directions = np.zeros_like(points)
        for index, model in enumerate(models):
            mine = alive & (surface == index)
            directions[mine], weight, above = reference.scatter(model, frame[mine], view[mine], rng)
            throughput[mine] *= weight * above[:, None]
        hits, inside = other_hit(points, directions, surface)
        radiance += throughput * (alive & ~inside)[:, None]
        alive &= inside
        points, view, surface = hits, -directions, 1 - surface
    return radiance.reshape(samples, RESOLUTION, RESOLUTION, 3).mean(0)


FLOOR_AND_WALL = MODELS["metal"], MODELS["plastic"]


@cache
def references():
    rng = np.random.default_rng(0)
    return [blocks(picture(FLOOR_AND_WALL, 400, rng), BLOCK) for _ in range(4)]


@pytest.fixture
def corner(stage):
    def build(materials, **settings):
        scene = stage.scene((RESOLUTION, RESOLUTION), light=1.0, **settings)
        r = REACH
        floor = [(-r, -r, 0), (r, -r, 0), (r, 0, 0), (-r, 0, 0)]
        wall = [(-r, 0, 0), (r, 0, 0), (r, 0, r), (-r, 0, r)]
        for material, vertices in zip(materials, (floor, wall), strict=True):
            stage.mesh(scene, material, vertices, [(0, 1, 2, 3)])
        stage.camera(scene, WIDTH, 45, distance=5)
        cycles = scene.cycles
        # Cycles counts the bounces after the first
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 1
        return scene

    return build


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_two_bounces_equal_the_reference(sampling, corner, new_material, render):
    materials = [new_material(model, sampling.name) for model in FLOOR_AND_WALL]
    scene = corner(materials, samples=256)
    pictures = [blocks(picture, BLOCK) for picture in render_seeds(render, scene, range(3))]
    check_equal(pictures, references(), noise=0.02, error=sampling.error)
