# SPDX-License-Identifier: GPL-3.0-or-later
import json

import numpy as np
import pytest

from benchmarks import rgl
from fitter.pictures.sphere import display, rendered_psnr

SIZE = 32


def picture(rng, noise):
    """Two maps, two seeds: a grey sphere with independent noise in each."""
    return 0.5 + noise * rng.standard_normal((2, 2, SIZE, SIZE, 3))


def test_noise_is_that_of_the_mean_of_both_seeds(rng):
    """Known noise: the PSNR of the mean against the truth, which is not known in a render."""
    pictures = {key: picture(rng, 0.02) for key in ("mitsuba", "native", "exact")}
    grades = rgl.render_grades(pictures, SIZE)
    truth = np.full((1, SIZE * SIZE, 3), 0.5)
    mean = pictures["native"].mean(1).reshape(2, 1, -1, 3)
    for found, one in zip(grades["native_noise"], mean, strict=True):
        assert found == pytest.approx(rendered_psnr(one, truth)[0], abs=1)


def test_samplings_are_compared_with_mitsuba_inside_the_sphere(rng):
    pictures = {key: picture(rng, 0) for key in ("mitsuba", "native", "exact")}
    pictures["native"] = pictures["native"] * 1.1
    pictures["exact"][:, :, 0, 0] = 100  # outside: in the corner
    grades = rgl.render_grades(pictures, SIZE)
    one, other = (display(np.full((1, 3), value), np.full((1, 3), 0.5)) for value in (0.5, 0.55))
    wanted = -20 * np.log10(np.abs(one - other).mean())
    np.testing.assert_allclose(grades["native"], wanted, rtol=1e-9)
    assert min(grades["exact"]) > 100


def test_negative_light_is_none(rng):
    """Mitsuba keeps negative channels of colours out of gamut; ours are clamped."""
    pictures = {key: np.full((2, 2, SIZE, SIZE, 3), 0.5) for key in ("mitsuba", "native", "exact")}
    pictures["mitsuba"][..., 2] = -1
    pictures["native"][..., 2] = 0
    assert min(rgl.render_grades(pictures, SIZE)["native"]) > 100


def test_what_is_done_is_kept(tmp_path):
    path = tmp_path / "a.json"
    assert rgl.kept(path, lambda: {"x": [1.0]}) == {"x": [1.0]}
    assert rgl.kept(path, lambda: pytest.fail("done twice")) == {"x": [1.0]}
    assert json.loads(path.read_text()) == {"x": [1.0]}
