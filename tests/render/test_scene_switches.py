"""What Filter Glossy and Reflective Caustics do to light that a surface throws on a diffuse one.

Cycles' defaults are Filter Glossy 1 and caustics on. The standard scenes set Filter Glossy to 0.
"""

import numpy as np
import pytest

from tests.models import MODELS
from tests.render.samplings import SAMPLINGS

RAMP = f"color ramp[8] = {{{', '.join(['color(1)'] * 8)}}};"
CLOSURES = {
    "reflection": "reflection(N)",
    "microfacet": "generalized_schlick_bsdf(N, vector(0), color(1), color(0), 0.05, 0.05, "
    'color(1), color(1), 5.0, "ggx")',
    "phong_ramp": "phong_ramp(N, 300.0, ramp)",
    "diffuse_ramp": "diffuse_ramp(N, ramp)",
}


def surface(closure):
    return f"shader surface(output closure color BSDF = 0) {{ {RAMP} BSDF = {closure}; }}"


@pytest.fixture
def thrown(stage, script_material, render):
    """Light (3,) that reaches a camera from a lamp over a wall and then a diffuse floor."""

    def measure(wall, *, filter_glossy=0.0, caustics=True):
        floor = script_material(surface("0.8 * diffuse(N)"))
        lamp = script_material(surface("(1.0 - backfacing()) * 20.0 * emission()"))
        scene = stage.scene((16, 16), samples=64)
        squares = {
            floor: [(-1, -1, 0), (1, -1, 0), (1, 0, 0), (-1, 0, 0)],
            wall: [(-1, 0, 0), (1, 0, 0), (1, 0, 1), (-1, 0, 1)],
            # faces the wall
            lamp: [(-0.3, -1.3, 0.8), (-0.3, -1.3, 1.2), (0.3, -1.3, 1.2), (0.3, -1.3, 0.8)],
        }
        for material, vertices in squares.items():
            item = stage.mesh(scene, material, vertices, [(0, 1, 2, 3)])
        item.visible_camera = False
        stage.camera(scene, 0.6, 45, distance=5).location.y -= 0.5
        scene.cycles.blur_glossy = filter_glossy
        scene.cycles.caustics_reflective = caustics
        both = render(scene)
        scene.cycles.max_bounces = 0
        return (both - render(scene)).mean((0, 1))

    return measure


@pytest.mark.parametrize(
    ("closure", "kept"),
    [("reflection", 1), ("microfacet", 0), ("phong_ramp", 1), ("diffuse_ramp", 1)],
)
def test_caustics_off_only_microfacet_closures_vanish(closure, kept, script_material, thrown):
    """So the rest of a sum of both kinds remains, be it negative."""
    wall = script_material(surface(CLOSURES[closure]))
    np.testing.assert_allclose(thrown(wall, caustics=False), kept * thrown(wall), atol=1e-6)


@pytest.mark.parametrize(
    ("closure", "kept"),
    [("reflection", 0.73), ("microfacet", 0.77), ("phong_ramp", 1), ("diffuse_ramp", 1)],
)
def test_filter_glossy_blurs_all_but_ramps(closure, kept, script_material, thrown):
    """A lobe becomes at least alpha 0.5 wide, and here misses the lamp more often."""
    wall = script_material(surface(CLOSURES[closure]))
    np.testing.assert_allclose(thrown(wall, filter_glossy=1) / thrown(wall), kept, atol=0.03)


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_reflective_caustics(sampling, new_material, thrown):
    wall = new_material(MODELS["metal"], sampling.name)
    kept = thrown(wall, caustics=False) / thrown(wall)
    # ramps that take light away remain where there is none left: it may be a little negative
    np.testing.assert_allclose(kept, sampling.kept_without_caustics, atol=0.05)


@pytest.mark.parametrize("sampling", SAMPLINGS, ids=str)
def test_filter_glossy(sampling, new_material, thrown):
    wall = new_material(MODELS["metal"], sampling.name)
    kept = thrown(wall, filter_glossy=1) / thrown(wall)
    np.testing.assert_allclose(kept, sampling.kept_by_filter_glossy, atol=0.05)
