import argparse

import numpy as np
import pytest

from benchmarks import expected, lights, render
from benchmarks.expected import Blocks, Environment, expected_picture
from fitter.models.model import FactorModel
from fitter.models.tables import directional_albedo, sampling_tables, versine_nodes
from tests.models import MODELS

FRACTIONS = np.arange(1, 50) / 50


@pytest.mark.parametrize("name", ["matte", "metal", "velvet"])
def test_white_light_gives_the_albedo(name, rng):
    radius = np.array([0.1, 0.4, 0.7, 0.9])
    blocks = Blocks(radius, np.zeros(4), 1e-3)
    white = Environment(np.ones((16, 32, 3)))
    picture = expected_picture(MODELS[name], white, blocks, 1 << 15, rng)
    albedo = directional_albedo(MODELS[name], np.arcsin(radius))
    np.testing.assert_allclose(picture, albedo, rtol=0.01)


def test_map_is_the_same_drawn_from_its_texels_or_from_the_lobes(rng, monkeypatch):
    image = np.full((32, 64, 3), 0.1)
    image[8:10, 40:42] = 300
    source = Environment(image)
    blocks = Blocks(np.array([0.0, -0.3, 0.3]), np.array([0.2, 0.3, 0.5]), 0.02)
    picture = expected_picture(MODELS["matte"], source, blocks, 1 << 15, rng)
    even = Environment(np.ones((32, 64, 3)))
    monkeypatch.setattr(source, "draw", even.draw)
    monkeypatch.setattr(source, "density", even.density)
    other = expected_picture(MODELS["matte"], source, blocks, 1 << 17, rng)
    np.testing.assert_allclose(picture, other, rtol=0.05)


def test_lobes_are_drawn_in_proportion_to_their_density():
    tables, nodes = sampling_tables(MODELS["paint"]), versine_nodes()
    u = np.linspace(0.001, 0.999, 500)
    fine = np.sort(np.concatenate([nodes, *(nodes[:-1] + t * np.diff(nodes) for t in FRACTIONS)]))
    for density, cumulative in zip(tables.density, tables.cumulative, strict=True):
        value = np.interp(fine, nodes, density)
        areas = np.pi * (value[1:] + value[:-1]) * np.diff(fine)
        integral = np.concatenate([[0], np.cumsum(areas)])
        versine = expected._invert(density, cumulative, u)
        np.testing.assert_allclose(np.interp(versine, fine, integral), u, atol=2e-4)


@pytest.mark.parametrize(
    "source", [expected.SphereLamp(0.4), expected.SquareLamp(1.5)], ids=["sphere", "square"]
)
def test_density_of_a_lamp_is_that_of_its_draws(source, rng):
    count = 400_000
    points = np.broadcast_to([0.2, -0.5, 0.8], (count, 3))
    drawn = source.draw(points, rng.random((count, 2)))
    # mean of 1 / density is the solid angle; so is the share of directions that hit
    axis = drawn.mean(0) / np.linalg.norm(drawn.mean(0))
    cap = 1 - (drawn @ axis).min() + 0.01
    z = 1 - cap * rng.random(count)
    phi = 2 * np.pi * rng.random(count)
    right = np.cross(axis, [1.0, 0, 0])
    right /= np.linalg.norm(right)
    sine = np.sqrt(1 - z**2)[:, None]
    around = np.cos(phi)[:, None] * right + np.sin(phi)[:, None] * np.cross(axis, right)
    even = z[:, None] * axis + sine * around
    hit = (source.density(points, even) > 0).mean() * 2 * np.pi * cap
    assert (1 / source.density(points, drawn)).mean() == pytest.approx(hit, rel=0.01)
    assert (source.radiance(points, drawn) > 0).all()


@pytest.mark.parametrize("name", ["map", "lamp", "area", "zero"])
def test_cycles_shows_a_lambert_sphere_as_bright(
    name, extension, addon, coarse_sphere, tmp_path, rng
):
    coarse_sphere(256)
    light = lights.LIGHTS.get(name)
    if light is None:
        path = tmp_path / "map.exr"
        addon("images").write_linear(path, addon("demo_light").studio())
        light = lights.Light(name, name, environment=path)
    arguments = argparse.Namespace(resolution=32, ground=False)
    stage = render.Stage(f"{extension.__name__}.nfm_addon", light, arguments)
    metal = MODELS["metal"]
    model = FactorModel(
        np.array([0.6, 0.4, 0.2]) / np.pi, 0 * metal.scale, metal.ndf, metal.masking, metal.fresnel
    )
    diffuse = render.principled_node.build(
        render.principled_node.Inputs(0.0, 1.0, (0.6, 0.4, 0.2), 1.0, (1.0,) * 3, 0.0)
    )
    picture, _ = stage.render(diffuse, 128, 0)
    shown = stage.block_means(picture)
    truth = expected_picture(model, stage.source, stage.blocks, 2048, rng)
    assert shown.mean(0) == pytest.approx(truth.mean(0), rel=0.01)
    # the whole picture, its orientation included
    assert np.abs(shown - truth).mean() / truth.mean() < 0.04
