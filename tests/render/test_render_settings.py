"""What a user may switch on for a final render: adaptive sampling and the denoiser."""

import numpy as np
import pytest

from fitter.models.tables import directional_albedo
from tests.models import MODELS
from tests.render.samplings import SAMPLINGS

VIEW = 40
EXPECTED = directional_albedo(MODELS["plastic"], np.radians([VIEW]))[0]


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_adaptive_sampling_keeps_the_mean(sampling, stage, new_material, render):
    scene = stage.tilted_plane(new_material(MODELS["plastic"], sampling.name), VIEW, samples=256)
    pixels = render(scene)
    scene.cycles.use_adaptive_sampling = True
    scene.cycles.adaptive_threshold = 0.1
    scene.cycles.adaptive_min_samples = 32
    adaptive = render(scene)
    # it did stop early somewhere
    assert (adaptive.std((0, 1)) > 1.1 * pixels.std((0, 1))).all()
    np.testing.assert_allclose(adaptive.mean((0, 1)), EXPECTED, rtol=0.01 + sampling.error)


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_denoiser_keeps_the_mean(sampling, stage, new_material, render):
    import _cycles

    if not _cycles.with_openimagedenoise:
        pytest.skip("this Blender was built without OpenImageDenoise")
    scene = stage.tilted_plane(new_material(MODELS["plastic"], sampling.name), VIEW, samples=8)
    noisy = render(scene)
    scene.cycles.use_denoising = True
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    clean = render(scene)
    assert (clean.std((0, 1)) < 0.7 * noisy.std((0, 1))).all()
    np.testing.assert_allclose(clean.mean((0, 1)), EXPECTED, rtol=0.01 + sampling.error)
