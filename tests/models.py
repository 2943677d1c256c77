"""Factor models of several classes for tests that need no measurement and no fit."""

import math
from dataclasses import replace

import numpy as np

from fitter import polar_grid
from fitter.geometry import theta_d_centres, theta_h_centres
from fitter.models.anisotropic_model import AnisotropicModel
from fitter.models.model import FactorModel
from fitter.models.splines import masking_nodes


def ggx(alpha):
    cos2 = np.cos(theta_h_centres()) ** 2
    return alpha**2 / (np.pi * (cos2 * (alpha**2 - 1) + 1) ** 2)


def smith(alpha):
    cosine = np.cos(masking_nodes())
    return 2 * cosine / (cosine + np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2))


def make(diffuse, f0, alphas, weights):
    """Sum of GGX lobes as factors; scale = weight / 4, the factor of the microfacet formula."""
    f0 = np.array(f0)[:, None]
    rise = (1 - np.cos(theta_d_centres())) ** 5
    return FactorModel(
        diffuse=np.array(diffuse) / np.pi,
        scale=np.array(weights) / 4,
        ndf=np.stack([ggx(a) for a in alphas]),
        masking=np.stack([smith(a) for a in alphas]),
        fresnel=f0 + (1 - f0) * rise,
    ).normalized()


def velvet():
    """D grows towards grazing half vectors, as cloth does."""
    model = make((0.1, 0.02, 0.05), (0.05,) * 3, (0.5, 0.7, 0.9), np.full((3, 3), 0.3))
    sheen = np.sin(theta_h_centres()) ** 2
    return FactorModel(
        model.diffuse,
        model.scale * [[1], [1], [4]],
        np.stack([*model.ndf[:2], sheen]),
        model.masking,
        model.fresnel,
    ).normalized()


MODELS = {
    "matte": make((0.6, 0.4, 0.2), (0.04,) * 3, (0.3, 0.5, 0.8), np.full((3, 3), 0.2)),
    "plastic": make(
        (0.05, 0.1, 0.3), (0.04,) * 3, (0.05, 0.12, 0.4), [[0.6] * 3, [0.3] * 3, [0.1] * 3]
    ),
    "metal": make((0, 0, 0), (0.9, 0.7, 0.4), (0.01, 0.04, 0.2), [[0.5] * 3, [0.3] * 3, [0.2] * 3]),
    "paint": make(
        (0.02, 0.02, 0.05),
        (0.1, 0.1, 0.12),
        (0.01, 0.25, 0.6),
        [[0.3] * 3, [2.0, 1.5, 2.5], [1.0, 0.5, 0.5]],
    ),
    "velvet": velvet(),
}


def bilinear(table, theta, phi, last_row=(0,) * 48):
    """A table (6, 48) of an anisotropic model at one direction, with a row at 90 degrees."""
    rows = [*table, last_row]
    row, column = math.degrees(theta) / 15, math.degrees(phi) % 360 / 7.5
    r, c = min(int(row), 5), int(column) % 48
    t, s = row - r, column - int(column)
    return (1 - t) * ((1 - s) * rows[r][c] + s * rows[r][(c + 1) % 48]) + t * (
        (1 - s) * rows[r + 1][c] + s * rows[r + 1][(c + 1) % 48]
    )


def ggx_at(h, alpha_x, alpha_y):
    """Anisotropic GGX at unit vectors (..., 3)."""
    slope2 = (h[..., 0] / alpha_x) ** 2 + (h[..., 1] / alpha_y) ** 2 + h[..., 2] ** 2
    return 1 / (np.pi * alpha_x * alpha_y * slope2**2)


def smith_at(w, alpha_x, alpha_y):
    slope2 = (w[..., 0] * alpha_x) ** 2 + (w[..., 1] * alpha_y) ** 2
    return 2 / (1 + np.sqrt(1 + slope2 / w[..., 2] ** 2))


def make_anisotropic(diffuse, f0, alphas, weights):
    """Sum of GGX lobes with two roughnesses each, tabulated at the nodes."""
    f0 = np.array(f0)[:, None]
    nodes = polar_grid.directions()
    return AnisotropicModel(
        diffuse=np.array(diffuse) / np.pi,
        scale=np.array(weights) / 4,
        ndf=np.stack([ggx_at(nodes, *a).reshape(polar_grid.GRID) for a in alphas]),
        masking=np.stack([smith_at(nodes, *a).reshape(polar_grid.GRID) for a in alphas]),
        fresnel=f0 + (1 - f0) * (1 - np.cos(theta_d_centres())) ** 5,
    ).normalized()


def anisotropic_pile():
    """D grows towards grazing half vectors on one side, as that of cloth whose pile leans."""
    model = make_anisotropic(
        (0.1, 0.02, 0.05), (0.05,) * 3, ((0.4, 0.7), (0.7, 0.5), (0.9, 0.9)), np.full((3, 3), 0.3)
    )
    nodes = polar_grid.directions()
    sheen = (1 - nodes[:, 2]) * (1 + 0.6 * nodes[:, 0])
    ndf = np.stack([*model.ndf[:2], sheen.reshape(polar_grid.GRID)])
    return replace(model, ndf=ndf, scale=model.scale * [[1], [1], [4]]).normalized()


def random_anisotropic(seed):
    """Unrelated random factors, no zeros, not in the gauge, poles tied."""
    rng = np.random.default_rng(seed)
    ndf, masking = rng.uniform(0.1, 3, (2, 3, 6, 48))
    for table in (ndf, masking):
        table[:, 0] = table[:, 0, :1]
    return AnisotropicModel(
        diffuse=rng.uniform(0.01, 0.1, 3),
        scale=rng.uniform(0.1, 2, (3, 3)),
        ndf=ndf,
        masking=masking,
        fresnel=rng.uniform(0.2, 2, (3, 90)),
    )


ANISOTROPIC_MODELS = {
    "brushed": make_anisotropic(
        (0.02, 0.01, 0.01),
        (0.9, 0.7, 0.5),
        ((0.12, 0.4), (0.3, 0.5), (0.6, 0.6)),
        [[0.5] * 3, [0.3] * 3, [0.2] * 3],
    ),
    "satin": make_anisotropic(
        (0.1, 0.2, 0.4),
        (0.2, 0.2, 0.25),
        ((0.5, 0.2), (0.3, 0.9), (0.8, 0.8)),
        [[0.6, 0.5, 0.4], [0.3, 0.4, 0.3], [0.2, 0.2, 0.4]],
    ),
    "pile": anisotropic_pile(),
}
