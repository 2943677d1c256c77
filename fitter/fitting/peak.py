# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a fit is far brighter at the horizon than anything that was measured, its F is lowered.

G / cos theta grows without end towards the horizon, and the bins there weigh next to nothing: two
directions within a degree of it see a hundredth of the light of others. So a fit may follow the
data everywhere else and be several times too bright in the last bins. Opposite directions near the
horizon have theta_d near 90 degrees, where hardly anything else is: lowering F there leaves
pictures as they are, which lowering G does not (1.1 dB less on a metallic paint).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ..geometry import HALF_PI, N_PHI_D, N_THETA_D, N_THETA_H, merl_bins
from ..models.model import FactorModel
from .problem import amplitudes, angle_bins

# Times the data's largest value. Angles are snapped, see below; that leaves 3.
MOST_PEAK = 2.75

# Angles at which G is looked up: 0.025 degrees apart, 1 / cos differs by 3 % there at 89.5 degrees.
N_ANGLES = 3600


def within_peak(model: FactorModel, largest: float) -> FactorModel:
    """The model, or one of at most MOST_PEAK times `largest` at the bin centres of a MERL file.

    largest : value of the data, 1/sr
    """
    bin_i, bin_o, above = _angle_bins()
    theta = (np.arange(N_ANGLES) + 0.5) / N_ANGLES * HALF_PI
    u = model.evaluate_masking(theta) / np.cos(theta)
    kernels = [np.where(above, row[bin_i] * row[bin_o], 0) for row in u]
    a = amplitudes(model).reshape(-1, model.n_lobes, 3)
    share = np.ones_like(model.fresnel)
    for c, diffuse in enumerate(model.diffuse):
        specular = sum(a[:, m, c, None] * kernel for m, kernel in enumerate(kernels))
        brightest = specular.max(axis=1).reshape(N_THETA_H, N_THETA_D).max(axis=0)
        room = max(MOST_PEAK * largest - diffuse, 0)
        share[c] = np.minimum(room / np.maximum(brightest, np.finfo(float).tiny), 1)
    if (share == 1).all():
        return model
    return replace(model, fresnel=model.fresnel * share).normalized()


@cache
def _angle_bins() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Snapped theta_i and theta_o of each bin, and whether both are above the horizon: (8100, 90).

    Bins phi_d and pi - phi_d hold the same angles, exchanged: one half is enough.
    """
    bins = merl_bins()
    half = np.s_[:, :, : N_PHI_D // 2]
    bin_i, bin_o = (angle_bins(cosine[half], N_ANGLES) for cosine in (bins.cos_i, bins.cos_o))
    return bin_i, bin_o, bins.above_horizon[half].reshape(bin_i.shape)
