import numpy as np
import pytest

from benchmarks import principled_node
from fitter.shading.closures import Closure
from tests.models import MODELS

F0 = np.array([0.05, 0.06, 0.04])


def planted(alpha, diffuse, f0=F0):
    def f_r(wi, wo):
        ggx = Closure("ggx", alpha).columns(wi, wo[0]).sum(0) / wi[:, 2]
        return np.array(diffuse) / np.pi + f0 * ggx[:, None]

    return f_r


@pytest.mark.parametrize("alpha", [0.01, 0.17, 0.6])
def test_dielectric_is_recovered(alpha):
    matched = principled_node.match(planted(alpha, (0.3, 0.2, 0.1)))
    assert matched.metallic == 0
    assert matched.roughness**2 == pytest.approx(alpha, rel=1e-3)
    assert matched.base_color == pytest.approx((0.3, 0.2, 0.1), rel=1e-3)
    root = np.sqrt(F0.mean())
    assert matched.ior == pytest.approx((1 + root) / (1 - root), rel=1e-3)
    assert matched.specular_tint == pytest.approx(np.minimum(F0 / F0.mean(), 1), rel=1e-3)
    assert matched.error < 1e-3


@pytest.mark.parametrize(("along", "across", "rotation"), [(0.3, 0.12, 0.0), (0.1, 0.25, 0.25)])
def test_two_alphas_are_recovered(along, across, rotation):
    def f_r(wi, wo):
        ggx = Closure("ggx", along, across=across).columns(wi, wo[0]).sum(0) / wi[:, 2]
        return F0 * ggx[:, None] + 0.2 / np.pi

    matched = principled_node.match(f_r, directed=True)
    assert matched.roughness**4 == pytest.approx(along * across, rel=1e-2)
    ratio = min(along, across) / max(along, across)
    assert 1 - 0.9 * matched.anisotropic == pytest.approx(ratio, rel=1e-2)
    assert matched.rotation == rotation


def test_what_has_no_lambert_is_metallic():
    f0 = np.array([0.8, 0.6, 0.3])
    matched = principled_node.match(planted(0.1, (0, 0, 0), f0))
    assert matched.metallic == 1
    assert matched.roughness**2 == pytest.approx(0.1, rel=1e-3)
    assert matched.base_color == pytest.approx(f0, rel=1e-3)


def test_known_metal_is_metallic_even_with_lambert():
    f_r = planted(0.1, (0.3, 0.3, 0.3))
    assert principled_node.match(f_r).metallic == 0
    assert principled_node.match(f_r, metal=True).metallic == 1


def test_error_tells_a_poor_match():
    assert principled_node.match(MODELS["metal"].f_r).error > 0.1
    assert principled_node.match(MODELS["matte"].f_r).error < 0.1


def test_build_sets_the_inputs(blender):
    matched = principled_node.Inputs(0.0, 0.4, (0.3, 0.2, 0.1), 1.7, (1.0, 0.5, 0.25), 0.0)
    tree = principled_node.build(matched).node_tree
    node = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    inputs = node.inputs
    assert inputs["Roughness"].default_value == pytest.approx(0.4)
    assert inputs["IOR"].default_value == pytest.approx(1.7)
    assert tuple(inputs["Base Color"].default_value)[:3] == pytest.approx((0.3, 0.2, 0.1))
    assert tuple(inputs["Specular Tint"].default_value)[:3] == pytest.approx((1, 0.5, 0.25))
    assert node.outputs["BSDF"].is_linked
