"""The base lobes inside Cycles are those of the fitter: as a number, and as closures."""

import re

import numpy as np
import pytest

from fitter.geometry import normalized
from fitter.quadrature import view_quadrature
from tests.bases import base_of
from tests.models import ANISOTROPIC_MODELS, MODELS
from tests.render.scenes import mean_and_noise, normals_at

COUNT = 200
VIEWS = np.radians([3, 40, 65, 80])
ALL_MODELS = MODELS | ANISOTROPIC_MODELS


@pytest.fixture(params=ALL_MODELS)
def name(request):
    return request.param


@pytest.fixture(scope="module")
def bases():
    return {name: base_of(name) for name in ALL_MODELS}


@pytest.fixture
def base_value(addon, monkeypatch):
    """What exact sampling's shader takes the base for, (n, 3), at pairs of directions (n, 3)."""
    module = addon("evaluate")
    new_surface = addon("shader_source").new_surface
    after_the_base = re.compile(r"sum = base_lobes\([^;]*;\n")
    statement = """
    vector half = normalize(wo + LightDirection);
    vector tilt = cross(n, half);
    Value = base_value(n, tangent, bitangent, side, theta_o, phi_o, wo, LightDirection,
                       AZIMUTH(LightDirection), dot(tilt, tilt), AZIMUTH(half), dot(half, wo),
                       CLOSURES, weights);
"""

    def shader(model, _sampling):
        source = new_surface(model, "exact").source
        changed, count = after_the_base.subn(lambda found: found[0] + statement, source)
        assert count == 1
        return addon("shader_source").Surface(changed, None)

    monkeypatch.setattr(module, "new_surface", shader)
    return module.evaluate_through_osl


def pairs(rng):
    """Random directions above the horizon, half of them near the mirror direction."""
    wi, wo = normalized(rng.normal(size=(2, COUNT, 3)))
    for directions in (wi, wo):
        directions[:, 2] = np.maximum(np.abs(directions[:, 2]), 0.02)
    near = slice(0, COUNT // 2)
    spread = 10 ** rng.uniform(-3, -0.5, (COUNT // 2, 1))
    wi[near] = wo[near] * [-1, -1, 1] + spread * rng.normal(size=(COUNT // 2, 3))
    wi[:, 2] = np.abs(wi[:, 2])
    # as the shader sees them
    return [normalized(d).astype(np.float32).astype(float) for d in (wi, wo)]


def expected_value(base, wi, wo):
    """Value (3,) of a base at a pair, and the largest there is at this view angle."""
    theta_o, phi_o = np.arctan2(np.hypot(wo[0], wo[1]), wo[2]), np.arctan2(wo[1], wo[0])
    view = view_quadrature(float(theta_o), 64, 12).turned(phi_o)
    everywhere = np.abs(base.value(view.wi, wo)).max()
    value = base.value(wi[None], wo)[0]
    return value, max(everywhere, np.abs(value).max())


def test_number_equals_the_fitter_s(name, bases, base_value):
    wi, wo = pairs(np.random.default_rng(3))
    found = base_value(ALL_MODELS[name], wi, wo)
    rows = [expected_value(bases[name], *pair) for pair in zip(wi, wo, strict=True)]
    expected, largest = (np.array(column) for column in zip(*rows, strict=True))
    error = np.abs(found - expected).max(1) / largest
    assert error.max() < 1e-4
    # the pairs do not miss the lobes
    assert np.mean(np.abs(expected).max(1) > 0.05 * largest) > 0.2


@pytest.mark.parametrize("name", MODELS)
def test_native_shows_the_albedo_of_the_base(name, bases, stage, new_material, render):
    """Uniform light: what Cycles makes of the closures, their signs and their picking."""
    albedo = []
    for theta in VIEWS:
        view = view_quadrature(theta, 300, 60)
        value = base_and_diffuse(bases[name], MODELS[name], view)
        albedo.append(view.solid_angle @ value)
    albedo = np.array(albedo)
    phi = np.random.default_rng(0).uniform(0, 2 * np.pi, (len(VIEWS), 256))
    normals = normals_at(VIEWS[:, None], phi).reshape(-1, 32, 3)
    material = new_material(MODELS[name], "NATIVE")
    pixels = render(stage.facets(material, normals, samples=256, light=1.0))
    mean, noise = mean_and_noise(pixels.reshape(len(VIEWS), 1, 256, 3))
    assert (noise < 1.5e-3 * albedo).all()
    assert (np.abs(mean - albedo) < 5e-3 * albedo + 3 * noise).all()


def base_and_diffuse(base, model, view):
    return base.value(view.wi, view.wo) + model.diffuse * view.wi[:, 2:]
