"""The picture of the standard sphere is that of an independent estimator of the same model."""

import numpy as np
import pytest

from tests.models import ANISOTROPIC_MODELS, MODELS
from tests.render import reference
from tests.render.scenes import render_seeds

RESOLUTION, BLOCK = 64, 8


def blocks(pixels):
    n = RESOLUTION // BLOCK
    return pixels.reshape(n, BLOCK, n, BLOCK, 3).mean((1, 3))


def mean_and_error(pictures):
    pictures = np.array([blocks(picture) for picture in pictures])
    return pictures.mean(0), pictures.std(0, ddof=1) / np.sqrt(len(pictures))


ALL_MODELS = MODELS | ANISOTROPIC_MODELS


@pytest.mark.parametrize("name", ["plastic", "metal", "velvet", "brushed", "pile"])
def test_equals_the_numpy_reference(name, addon, sphere, new_material, render, tmp_path):
    images = addon("images")
    light = addon("demo_light").studio()
    environment = tmp_path / "light.exr"
    images.write_linear(environment, light)
    view = sphere.SphereView(resolution=RESOLUTION, samples=48, environment=environment)
    scene = sphere.build_scene(new_material(ALL_MODELS[name]), view)
    runs = 8
    cycles = render_seeds(render, scene, range(runs))
    rng = np.random.default_rng(0)
    exact = [
        reference.render(ALL_MODELS[name], light, RESOLUTION, samples=108, rng=rng)
        for _ in range(runs)
    ]
    mean, error = mean_and_error(cycles)
    expected, expected_error = mean_and_error(exact)
    # 1e-3: the mesh is not quite a sphere, the light not quite bilinear
    z = (mean - expected) / np.sqrt(error**2 + expected_error**2 + (1e-3 * expected) ** 2)
    # 8 runs of each estimate the error itself to a fifth: a few more outliers than a normal law
    assert np.abs(z).max() < 5.5
    assert np.sqrt((z**2).mean()) < 1.35
    assert abs(z.mean()) < 0.35


def test_point_sampling_sees_pixel_centres(sphere, new_material, render):
    """With rays through the centres, samples only average the light; the silhouette is sharp."""
    material = new_material(MODELS["matte"])
    view = sphere.SphereView(resolution=32, samples=16, point_sampled=True)
    pixels = render(sphere.build_scene(material, view))
    axis = ((np.arange(32) + 0.5) / 32 - 0.5) * sphere.CAMERA_WIDTH
    radius = np.hypot(axis[:, None], axis[None, :])
    assert (pixels[radius > 1.001] == 1).all()
    assert (pixels[radius < 0.99] < 0.999).all()


def test_seed_decides_the_noise(sphere, new_material, render):
    material = new_material(MODELS["plastic"])

    def picture(seed):
        return render(
            sphere.build_scene(material, sphere.SphereView(resolution=16, samples=4, seed=seed))
        )

    first = picture(3)
    assert (first == picture(3)).all()
    assert (first != picture(4)).any()


def test_reference_sampling_beats_cosine_sampling(addon, sphere, new_material, render, tmp_path):
    """A small version of ./nfm bench sampling."""
    images = addon("images")
    environment = tmp_path / "light.exr"
    images.write_linear(environment, addon("demo_light").studio())

    view = sphere.SphereView(resolution=24, samples=64, environment=environment)
    scenes = {
        sampling: sphere.build_scene(new_material(MODELS["metal"], sampling, candidates=1), view)
        for sampling in ("REFERENCE", "COSINE")
    }
    pictures = {s: np.array(render_seeds(render, scene, range(3))) for s, scene in scenes.items()}
    scenes["REFERENCE"].cycles.samples = 1024
    (converged,) = render_seeds(render, scenes["REFERENCE"], [99])
    error = {sampling: np.mean((found - converged) ** 2) for sampling, found in pictures.items()}
    assert error["COSINE"] > 32 * error["REFERENCE"]
