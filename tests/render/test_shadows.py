"""A lamp, something in its way, and the same in numpy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.models import MODELS
from tests.render.samplings import SAMPLINGS
from tests.render.scenes import blocks, check_equal, render_seeds

ANGLE = np.radians(35)
VIEW = np.array([0, -np.sin(ANGLE), np.cos(ANGLE)])
RESOLUTION, BLOCK, WIDTH = 24, 8, 2.4

LAMP_HEIGHT, POWER = 1.5, 20.0
# x and y from and to
SHADE = np.array([[-0.3, 0.5], [-0.4, 0.3]])
SHADE_HEIGHT = 0.6


def floor_points(offset):
    """Points (n, 3) of the floor seen at `offset` (n, 2), 0 to 1, in each pixel, and its normal."""
    row, column = np.indices((RESOLUTION, RESOLUTION)).reshape(2, -1)
    x = ((column + offset[:, 0]) / RESOLUTION - 0.5) * WIDTH
    y = (0.5 - (row + offset[:, 1]) / RESOLUTION) * WIDTH / np.cos(ANGLE)
    return np.stack([x, y, 0 * x], -1)


def lit(points, lamps):
    """Whether nothing is between points (n, 3) and lamps (n, 3)."""
    across = points + (lamps - points) * (SHADE_HEIGHT / lamps[:, 2:])
    inside = (across[:, :2] > SHADE[:, 0]) & (across[:, :2] < SHADE[:, 1])
    return ~inside.all(1)


def irradiated(model, points, lamps):
    """f cos_i / r^2 (n, 3) towards lamps, and their cosines (n,) if they look down."""
    to_lamp = lamps - points
    distance = np.linalg.norm(to_lamp, axis=1)
    wi = to_lamp / distance[:, None]
    weight = lit(points, lamps) * wi[:, 2] / distance**2
    return model.f_r(wi, np.broadcast_to(VIEW, wi.shape)) * weight[:, None], wi[:, 2]


def area_lamp_reference(model, rng, strata=10):
    """Picture under a lamp of 1 m x 1 m that looks down, of radiance POWER / pi."""
    total = np.zeros((RESOLUTION**2, 3))
    for i, j in np.ndindex(strata, strata):
        u, offset = rng.random((2, RESOLUTION**2, 2))
        lamps = np.concatenate(
            [(np.array([i, j]) + u) / strata - 0.5, np.full((RESOLUTION**2, 1), LAMP_HEIGHT)], 1
        )
        value, cosine = irradiated(model, floor_points(offset), lamps)
        total += value * cosine[:, None] * POWER / np.pi
    return (total / strata**2).reshape(RESOLUTION, RESOLUTION, 3)


@cache
def area_lamp_references(name):
    rng = np.random.default_rng(0)
    return [blocks(area_lamp_reference(MODELS[name], rng), BLOCK) for _ in range(4)]


@pytest.fixture
def shadow_scene(stage, blender):
    def build(material, lamp_kind, **settings):
        scene = stage.scene((RESOLUTION, RESOLUTION), **settings)
        stage.plane(scene, material, size=8)
        (x0, x1), (y0, y1) = SHADE
        z = SHADE_HEIGHT
        black = blender.data.materials.new("black")
        stage.addon("node_trees").empty_tree(black)
        shade = stage.mesh(
            scene, black, [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], [(0, 1, 2, 3)]
        )
        shade.visible_camera = False
        lamp = blender.data.lights.new("Lamp", lamp_kind)
        lamp.energy = POWER
        stage.add(scene, "Lamp", lamp, (0, 0, LAMP_HEIGHT))
        stage.camera(scene, WIDTH, np.degrees(ANGLE), distance=5)
        return scene, lamp

    return build


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
@pytest.mark.parametrize("name", ["matte", "plastic"])
def test_soft_shadow_equals_the_reference(name, sampling, shadow_scene, new_material, render):
    material = new_material(MODELS[name], sampling.name)
    scene, lamp = shadow_scene(material, "AREA", samples=128)
    lamp.size = 1.0
    pictures = [blocks(picture, BLOCK) for picture in render_seeds(render, scene, range(3))]
    references = area_lamp_references(name)
    check_equal(pictures, references, noise=0.04, error=sampling.error)
    # there is a shadow, and light too
    assert references[0].min() < 0.25 * references[0].max()


LAMBERT = replace(MODELS["matte"], scale=np.zeros((3, 3)))


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
@pytest.mark.parametrize("name", ["diffuse", "plastic", "paint"])
def test_hard_shadow_equals_the_reference(name, sampling, shadow_scene, new_material, render):
    """A lamp without size: every pixel has one light direction, and no noise."""
    if name != "diffuse" and not sampling.sees_points:
        pytest.skip("sees lamps without size with its diffuse part alone")
    model = MODELS.get(name, LAMBERT)
    material = new_material(model, sampling.name)
    scene, lamp = shadow_scene(material, "POINT", samples=64)
    lamp.shadow_soft_size = 0
    pictures = [blocks(picture, BLOCK) for picture in render_seeds(render, scene, range(2))]
    rng = np.random.default_rng(0)
    lamps = np.broadcast_to([0.0, 0, LAMP_HEIGHT], (RESOLUTION**2, 3))
    references = []
    for _ in range(2):
        values = [
            irradiated(model, floor_points(rng.random((RESOLUTION**2, 2))), lamps)[0]
            for _ in range(64)
        ]
        picture = np.mean(values, 0).reshape(RESOLUTION, RESOLUTION, 3)
        references.append(blocks(picture * POWER / (4 * np.pi), BLOCK))
    check_equal(pictures, references, noise=0.02, error=sampling.error)
