"""Cycles keeps all closures of a long sum: it must be nested to the right and fit into 64 slots."""

import numpy as np
import pytest

from fitter.models.tables import directional_albedo
from tests.models import MODELS
from tests.render.scenes import mean_and_noise

LINEAR_RAMP = ", ".join(f"color({i / 7:.9g})" for i in range(8))
LAMBERT = "diffuse_ramp(N, ramp)"
MICROFACET = (
    "generalized_schlick_bsdf(N, vector(0), color(1), color(0), 0.02, 0.02, color(1), color(1), "
    '5.0, "ggx")'
)


@pytest.fixture
def furnace(stage, script_material, render):
    """Mean of a facet under white light, made of `count` terms that add up to about 1."""

    def run(count, term, statement="sum = term + sum"):
        material = script_material(
            "shader long_sum(output closure color BSDF = 0)\n{\n"
            f"  color ramp[8] = {{{LINEAR_RAMP}}};\n"
            "  closure color sum = 0;\n"
            f"  for (int i = 0; i < {count}; i++) {{\n"
            f"    closure color term = (1.0 / {count}) * {term};\n    {statement};\n  }}\n"
            "  BSDF = sum;\n}\n"
        )
        facing = np.broadcast_to([0, 0, 1.0], (8, 8, 3))
        return render(stage.facets(material, facing, samples=64, light=1.0)).mean()

    return run


# slots: a diffuse closure takes 1, a microfacet closure 2, a ramp 3
@pytest.mark.parametrize(
    ("count", "term"), [(18, "diffuse(N)"), (64, "diffuse(N)"), (32, MICROFACET), (21, LAMBERT)]
)
def test_nested_to_the_right_nothing_is_lost(count, term, furnace):
    assert furnace(count, term) == pytest.approx(1, abs=2e-3)


def test_nested_to_the_left_18_terms_are_too_many(furnace):
    """Why the shader writes `sum = term + sum`."""
    assert furnace(17, "diffuse(N)", "sum = sum + term") == pytest.approx(1, abs=2e-3)
    assert furnace(18, "diffuse(N)", "sum = sum + term") < 0.95


@pytest.mark.parametrize(("count", "term"), [(65, "diffuse(N)"), (33, MICROFACET), (22, LAMBERT)])
def test_what_finds_no_slot_is_lost(count, term, furnace):
    """Cycles says nothing; a sum must count its slots."""
    assert furnace(count, term) == pytest.approx(1 - 1 / count, abs=2e-3)


@pytest.mark.parametrize("candidates", [1, 17, 63])
def test_many_candidates_lose_no_energy(candidates, stage, new_material, render):
    material = new_material(MODELS["paint"], candidates=candidates)
    normals = np.broadcast_to([0, -0.5, np.sqrt(0.75)], (32, 32, 3))
    scene = stage.facets(material, normals, samples=max(512 // candidates, 16), light=1.0)
    mean, noise = mean_and_noise(render(scene))
    expected = directional_albedo(MODELS["paint"], np.radians([30]))[0]
    assert (noise < 2e-3 * expected).all()
    assert (np.abs(mean - expected) < 4 * noise + 1e-3 * expected).all()
