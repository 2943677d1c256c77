# SPDX-License-Identifier: GPL-3.0-or-later
import math
from dataclasses import replace

import numpy as np
import pytest

from fitter import geometry, polar_grid
from fitter.models.anisotropic_model import AnisotropicModel
from tests.models import ANISOTROPIC_MODELS, bilinear, random_anisotropic

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


def by_hand(model, wi, wo):
    """Eq. 4, one number at a time."""
    total = [a + b for a, b in zip(wi, wo, strict=True)]
    length = math.sqrt(sum(x * x for x in total))
    theta_h, phi_h = math.acos(total[2] / length), math.atan2(total[1], total[0])
    at_d = math.degrees(math.acos(length / 2)) - 0.5
    left = min(max(int(at_d), 0), 88)
    t = min(max(at_d - left, 0), 1)
    out = []
    for c in range(3):
        value = model.diffuse[c]
        for m in range(3):
            product = model.scale[m, c] * bilinear(
                model.ndf[m], theta_h, phi_h, last_row=model.ndf[m][5]
            )
            product *= (1 - t) * model.fresnel[c, left] + t * model.fresnel[c, left + 1]
            for w in (wi, wo):
                theta, phi = math.acos(w[2]), math.atan2(w[1], w[0])
                product *= bilinear(model.masking[m], theta, phi) / w[2]
            value += product
        out.append(value)
    return out


def direction(theta, phi):
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def test_number_of_parameters():
    model = random_anisotropic(0)
    assert model.n_lobes == 3
    assert model.n_parameters == 2010


@pytest.mark.parametrize(
    ("theta_i", "phi_i", "theta_o", "phi_o"),
    [
        (0.3, 0.2, 0.7, 2.0),
        (1.2, 0.0, 1.1, 3.1),
        (0.01, 1.0, 0.02, 5.0),
        (1.45, 0.5, 0.4, 0.9),
        (1.5, 4.0, 1.55, 3.9),
        (0.8, 6.2, 0.8, 0.1),
    ],
)
def test_equation_4(theta_i, phi_i, theta_o, phi_o):
    model = random_anisotropic(1)
    wi, wo = direction(theta_i, phi_i), direction(theta_o, phi_o)
    got = model.f_r(np.array([wi]), np.array([wo]))[0]
    np.testing.assert_allclose(got, by_hand(model, wi, wo), rtol=1e-9)


def test_reciprocal_to_the_last_bit(upper_directions):
    rng = np.random.default_rng(0)
    wi, wo = upper_directions(rng, 20_000), upper_directions(rng, 20_000)
    model = random_anisotropic(2)
    forth = model.f_r(wi, wo)
    assert np.isfinite(forth).all()
    assert (forth > 0).all()
    np.testing.assert_array_equal(forth, model.f_r(wo, wi))


def test_azimuth_counts_from_the_tangent_counter_clockwise():
    """A ridge of D along +y shines where h leans to +y, and nowhere else."""
    ndf = np.full((3, 6, 48), 0.01)
    ndf[:, 1:, 12] = 1  # 90 degrees
    model = replace(random_anisotropic(3), ndf=ndf, diffuse=np.zeros(3))
    up = direction(0.0, 0.0)
    towards = {
        phi: model.f_r(np.array([direction(1.0, math.radians(phi))]), np.array([up]))[0, 0]
        / model.evaluate_masking(np.array([1.0]), np.array([math.radians(phi)]))[0, 0]
        for phi in (0, 90, 180, 270)
    }
    assert min(towards, key=towards.get) != 90
    assert towards[90] > 10 * max(value for phi, value in towards.items() if phi != 90)


def turned(w, angle):
    c, s = np.cos(angle), np.sin(angle)
    return w @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def test_turning_the_directions_is_turning_the_tables(upper_directions):
    rng = np.random.default_rng(1)
    wi, wo = upper_directions(rng, 1000), upper_directions(rng, 1000)
    model = random_anisotropic(4)
    steps = 5
    other = replace(
        model,
        ndf=np.roll(model.ndf, steps, axis=2),
        masking=np.roll(model.masking, steps, axis=2),
    )
    angle = steps * polar_grid.PHI_STEP
    np.testing.assert_allclose(
        other.f_r(turned(wi, angle), turned(wo, angle)), model.f_r(wi, wo), rtol=1e-9
    )


def test_zero_below_the_horizon():
    above, below, on = [0.6, 0.0, 0.8], [0.6, 0.0, -0.8], [1.0, 0.0, 0.0]
    wi = np.array([above, below, below, on, above])
    wo = np.array([below, above, below, above, on])
    model = random_anisotropic(5)
    np.testing.assert_array_equal(model.f_r(wi, wo), 0)
    # directions that cancel have no half vector
    np.testing.assert_array_equal(model.f_r(np.array([on]), -np.array([on])), 0)


@pytest.mark.parametrize("name", ANISOTROPIC_MODELS)
def test_beyond_75_degrees_bounded_positive_and_without_jumps(name):
    model = ANISOTROPIC_MODELS[name]
    theta = np.radians(np.linspace(70, 90, 20_001)[:-1])
    for phi_i, theta_o, phi_o in ((0.0, 0.5, 3.0), (1.0, 1.2, 4.0), (2.0, 1.5, 2.1)):
        wi = np.stack(
            [np.sin(theta) * np.cos(phi_i), np.sin(theta) * np.sin(phi_i), np.cos(theta)], -1
        )
        wo = np.tile(direction(theta_o, phi_o), (len(theta), 1))
        f = model.f_r(wi, wo)
        assert np.isfinite(f).all()
        assert (f >= model.diffuse).all()
        # a thousandth of a degree changes little, also across 75 degrees and at the horizon
        assert np.abs(np.diff(f, axis=0)).max() < 1e-3 * f.max()
        assert f.max() < 3 * f[: 5 * 1000].max()


def test_masking_over_cosine_hardly_changes_beyond_75_degrees():
    model = random_anisotropic(6)
    theta = np.radians([75.0, 80.0, 85.0, 89.0, 89.9999999])
    ratio = model.evaluate_masking(theta, np.full(5, 1.2)) / np.cos(theta)
    np.testing.assert_allclose(ratio, np.repeat(ratio[:, :1], 5, axis=1), rtol=0.012)


def test_ndf_is_constant_beyond_75_degrees():
    model = random_anisotropic(7)
    theta = np.radians([75.0, 80.0, 90.0])
    values = model.evaluate_ndf(theta, np.full(3, 0.7))
    np.testing.assert_allclose(values, np.repeat(values[:, :1], 3, axis=1), rtol=1e-14)


def test_no_jump_where_the_half_vector_passes_the_pole():
    """In single precision too, where the azimuth of h is noise: a mirror pair around the normal."""
    model = ANISOTROPIC_MODELS["brushed"]
    rng = np.random.default_rng(2)
    theta, phi = rng.uniform(0, 1.2, 2000), rng.uniform(-np.pi, np.pi, 2000)
    sin, cos = np.sin(theta), np.cos(theta)
    wi = np.stack([sin * np.cos(phi), sin * np.sin(phi), cos], -1)
    wo = wi * [-1, -1, 1]
    exact = model.f_r(wi, wo)
    rounded = model.f_r(wi.astype(np.float32), wo.astype(np.float32))
    np.testing.assert_allclose(rounded, exact, rtol=1e-5)


@pytest.mark.parametrize("change", [AnisotropicModel.normalized, AnisotropicModel.sorted_by_width])
def test_gauge_and_order_change_no_value(upper_directions, change):
    rng = np.random.default_rng(3)
    wi, wo = upper_directions(rng, 2000), upper_directions(rng, 2000)
    model = random_anisotropic(8)
    changed = change(model)
    assert isinstance(changed, AnisotropicModel)
    np.testing.assert_allclose(changed.f_r(wi, wo), model.f_r(wi, wo), rtol=1e-12)


def test_normalized_gives_the_gauge():
    model = random_anisotropic(9).normalized()
    for name in ("ndf", "masking"):
        np.testing.assert_array_equal(getattr(model, name).max((1, 2)), 1)
    np.testing.assert_array_equal(model.fresnel.max(1), 1)
    again = model.normalized()
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))


def test_sorted_by_width():
    model = ANISOTROPIC_MODELS["brushed"]
    width = model.ndf_width()
    assert (np.diff(width) > 0).all()
    order = [2, 0, 1]
    mixed = replace(
        model, ndf=model.ndf[order], masking=model.masking[order], scale=model.scale[order]
    )
    got = mixed.sorted_by_width()
    for name in FACTORS:
        np.testing.assert_array_equal(getattr(got, name), getattr(model, name))


def test_nodes_are_reproduced():
    model = random_anisotropic(10)
    theta, phi = (
        a.ravel()
        for a in np.meshgrid(polar_grid.theta_nodes(), polar_grid.phi_nodes(), indexing="ij")
    )
    shape = (3, 6, 48)
    np.testing.assert_allclose(model.evaluate_ndf(theta, phi).reshape(shape), model.ndf, rtol=1e-12)
    np.testing.assert_allclose(
        model.evaluate_masking(theta, phi).reshape(shape), model.masking, rtol=1e-12
    )
    np.testing.assert_allclose(
        model.evaluate_fresnel(geometry.theta_d_centres()), model.fresnel, rtol=1e-12
    )
