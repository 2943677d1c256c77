"""Under uniform white light a surface shows its directional albedo."""

import numpy as np
import pytest

from fitter.tables import directional_albedo
from tests.models import MODELS

ANGLES = (0, 30, 55, 70, 80)


@pytest.mark.parametrize("name", MODELS)
def test_furnace_shows_the_albedo(name, stage, new_material, render):
    expected = directional_albedo(MODELS[name], np.radians(ANGLES))
    material = new_material(MODELS[name])
    for angle, albedo in zip(ANGLES, expected, strict=True):
        pixels = render(stage.tilted_plane(material, angle, samples=192))
        np.testing.assert_allclose(pixels.mean((0, 1)), albedo, rtol=5e-3, err_msg=f"{angle} deg")


@pytest.mark.parametrize("name", ["plastic", "velvet"])
def test_cosine_sampling_has_the_same_mean(name, stage, new_material, render):
    expected = directional_albedo(MODELS[name], np.radians([40]))[0]
    material = new_material(MODELS[name], "COSINE")
    pixels = render(stage.tilted_plane(material, 40, samples=512))
    error = pixels.std((0, 1)) / 64
    assert (np.abs(pixels.mean((0, 1)) - expected) < 4 * error + 2e-3 * expected).all()


@pytest.mark.parametrize("candidates", [1, 17, 40])
def test_many_closures_lose_no_energy(candidates, stage, new_material, render):
    """Cycles walks a sum of closures with a short stack: more than 17 in the wrong order vanish."""
    expected = directional_albedo(MODELS["paint"], np.radians([30]))[0]
    material = new_material(MODELS["paint"], candidates=candidates)
    pixels = render(stage.tilted_plane(material, 30, samples=256 // min(candidates, 8)))
    np.testing.assert_allclose(pixels.mean((0, 1)), expected, rtol=7e-3)


def test_lobe_scales_and_diffuse_multiply(stage, new_material, render):
    """Sockets change the picture as the model says, without a new shader."""
    from dataclasses import replace

    model = MODELS["plastic"]
    factors = np.array([[0.5, 0.5, 0.5], [0.0, 0.0, 0.0], [3.0, 1.0, 0.2]])
    changed = replace(model, diffuse=np.array([0.3, 0.2, 0.1]), scale=model.scale * factors)
    material = new_material(model)
    group = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    group.inputs["Diffuse"].default_value = (*(np.pi * changed.diffuse), 1)
    for lobe, factor in enumerate(factors):
        group.inputs[f"Lobe {lobe + 1} Scale"].default_value = (*factor, 1)
    pixels = render(stage.tilted_plane(material, 30, samples=256))
    expected = directional_albedo(changed, np.radians([30]))[0]
    np.testing.assert_allclose(pixels.mean((0, 1)), expected, rtol=7e-3)


def test_seen_from_behind_is_finite(stage, new_material, render):
    pixels = render(stage.tilted_plane(new_material(MODELS["metal"]), 120, samples=8))
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()
