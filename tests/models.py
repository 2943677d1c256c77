"""Factor models of several classes for tests that need no measurement and no fit."""

import numpy as np

from fitter.geometry import theta_d_centres, theta_h_centres
from fitter.model import FactorModel
from fitter.splines import masking_nodes


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
