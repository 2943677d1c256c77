# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np
import pytest

from fitter import geometry
from fitter.models import splines
from fitter.models.model import FactorModel

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


def linear(nodes, values, at):
    """Straight lines through nodes, constant beyond the ends."""
    if at <= nodes[0]:
        return values[0]
    for k in range(len(nodes) - 1):
        if at <= nodes[k + 1]:
            t = (at - nodes[k]) / (nodes[k + 1] - nodes[k])
            return values[k] + t * (values[k + 1] - values[k])
    return values[-1]


def catmull_rom(values, theta):
    padded = [values[1], *values, 2 * values[89] - values[88]]
    position = theta / (math.pi / 2) * 89
    k = min(int(position), 88)
    t = position - k
    a, b, c, d = padded[k : k + 4]
    return 0.5 * (
        2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    )


def by_hand(model, wi, wo):
    """Eq. 3, one number at a time."""
    total = [a + b for a, b in zip(wi, wo, strict=True)]
    length = math.sqrt(sum(x * x for x in total))
    theta_h = math.acos(total[2] / length)
    theta_d = math.acos(length / 2)
    theta_i, theta_o = math.acos(wi[2]), math.acos(wo[2])
    axis_h = [math.sqrt(t / (math.pi / 2)) * 90 for t in geometry.theta_h_centres()]
    at_h = math.sqrt(theta_h / (math.pi / 2)) * 90
    out = []
    for c in range(3):
        value = model.diffuse[c]
        for m in range(3):
            value += (
                model.scale[m, c]
                * linear(axis_h, model.ndf[m], at_h)
                * linear(geometry.theta_d_centres(), model.fresnel[c], theta_d)
                * catmull_rom(model.masking[m], theta_i)
                * catmull_rom(model.masking[m], theta_o)
                / (wi[2] * wo[2])
            )
        out.append(value)
    return out


def direction(theta, phi):
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def test_number_of_parameters(planted):
    assert planted.n_lobes == 3
    assert planted.n_parameters == 822


@pytest.mark.parametrize(
    ("theta_i", "phi_i", "theta_o", "phi_o"),
    [
        (0.3, 0.2, 0.7, 2.0),
        (1.2, 0.0, 1.1, 3.1),
        (0.01, 1.0, 0.02, 5.0),
        (1.56, 0.5, 0.4, 0.9),
        (1.56, 0.5, 1.55, 3.0),
        (0.8, 2.0, 0.8, 2.3),
    ],
)
def test_equation_3(random_model, theta_i, phi_i, theta_o, phi_o):
    model = random_model(0)
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o)
    got = model.f_r(np.array([wi]), np.array([wo]))[0]
    np.testing.assert_allclose(got, by_hand(model, wi, wo), rtol=1e-9)


def test_head_on(random_model):
    model = random_model(1)
    up = np.array([[0.0, 0.0, 1.0]])
    expected = model.diffuse + model.fresnel[:, 0] * (
        model.scale * (model.ndf[:, 0] * model.masking[:, 0] ** 2)[:, None]
    ).sum(0)
    np.testing.assert_allclose(model.f_r(up, up)[0], expected, rtol=1e-14)


def test_reciprocal(random_model, upper_directions):
    rng = np.random.default_rng(0)
    wi, wo = upper_directions(rng, 20_000), upper_directions(rng, 20_000)
    model = random_model(2)
    forth, back = model.f_r(wi, wo), model.f_r(wo, wi)
    assert np.isfinite(forth).all()
    assert (forth > 0).all()
    np.testing.assert_allclose(forth, back, rtol=1e-12, atol=0)


def test_zero_below_the_horizon(random_model):
    above, below, on = [0.6, 0.0, 0.8], [0.6, 0.0, -0.8], [1.0, 0.0, 0.0]
    wi = np.array([above, below, below, on, above])
    wo = np.array([below, above, below, above, on])
    model = random_model(3)
    np.testing.assert_array_equal(model.f_r(wi, wo), 0)
    np.testing.assert_array_equal(model.lobe_values(wi, wo), 0)
    # directions that cancel have no half vector
    opposite = model.f_r(np.array([on]), -np.array([on]))
    np.testing.assert_array_equal(opposite, 0)


def test_lobes_add_up(random_model, upper_directions):
    rng = np.random.default_rng(1)
    wi, wo = upper_directions(rng, 100), upper_directions(rng, 100)
    model = random_model(4)
    lobes = model.lobe_values(wi, wo)
    assert lobes.shape == (3, 100, 3)
    for m in range(3):
        scale = np.zeros((3, 3))
        scale[m] = model.scale[m]
        alone = replace(model, scale=scale, diffuse=np.zeros(3))
        np.testing.assert_allclose(alone.f_r(wi, wo), lobes[m], rtol=1e-13)


@pytest.mark.parametrize("change", [FactorModel.normalized, FactorModel.sorted_by_width])
def test_gauge_and_order_change_no_value(random_model, upper_directions, change):
    rng = np.random.default_rng(2)
    wi, wo = upper_directions(rng, 2000), upper_directions(rng, 2000)
    model = random_model(5)
    before = {name: getattr(model, name).copy() for name in FACTORS}
    changed = change(model)
    np.testing.assert_allclose(changed.f_r(wi, wo), model.f_r(wi, wo), rtol=1e-12)
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(model, name), before[name])


def test_normalized_gives_the_gauge(random_model):
    model = random_model(6).normalized()
    for name in ("ndf", "masking", "fresnel"):
        np.testing.assert_array_equal(getattr(model, name).max(1), 1)
    again = model.normalized()
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))


def test_normalized_survives_a_dead_lobe(random_model):
    model = random_model(7)
    ndf = model.ndf.copy()
    ndf[1] = 0
    got = replace(model, ndf=ndf).normalized()
    assert all(np.isfinite(getattr(got, name)).all() for name in FACTORS)
    np.testing.assert_array_equal(got.ndf[1], 0)


def test_sorted_by_width(ggx, random_model):
    widths = (0.5, 0.02, 0.2)
    model = replace(random_model(8), ndf=np.stack([ggx(a) for a in widths]))
    got = model.sorted_by_width()
    for to, source in enumerate((1, 2, 0)):
        for name in ("ndf", "masking", "scale"):
            np.testing.assert_array_equal(getattr(got, name)[to], getattr(model, name)[source])
    np.testing.assert_array_equal(got.fresnel, model.fresnel)


def test_width_does_not_depend_on_the_gauge(ggx, random_model):
    ndf = np.stack([ggx(0.1), 1e6 * ggx(0.1), np.zeros(90)])
    width = replace(random_model(8), ndf=ndf).ndf_width()
    assert width[0] == pytest.approx(width[1], rel=1e-12)
    assert width[2] == 0


def test_nodes_are_reproduced(random_model):
    model = random_model(9)
    for curve, nodes, values in (
        (model.evaluate_ndf, geometry.theta_h_centres(), model.ndf),
        (model.evaluate_fresnel, geometry.theta_d_centres(), model.fresnel),
        (model.evaluate_masking, splines.masking_nodes(), model.masking),
    ):
        np.testing.assert_allclose(curve(nodes), values, rtol=1e-10)


def test_constant_beyond_the_end_nodes(random_model):
    model = random_model(10)
    ends = np.array([0, np.pi / 2])
    np.testing.assert_array_equal(model.evaluate_ndf(ends), model.ndf[:, [0, -1]])
    np.testing.assert_array_equal(model.evaluate_fresnel(ends), model.fresnel[:, [0, -1]])
