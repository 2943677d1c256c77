# SPDX-License-Identifier: GPL-3.0-or-later
"""A material that is exactly a FactorModel: what a perfect fit would recover."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fitter import merl
from fitter.geometry import merl_bins, theta_d_centres, theta_h_centres
from fitter.metrics import tabulate
from fitter.model import FactorModel
from fitter.splines import masking_nodes


def model() -> FactorModel:
    """Three GGX-like lobes (alpha 0.05, 0.18, 0.5) with a coloured Schlick-like F."""
    cos2 = np.cos(theta_h_centres()) ** 2
    ndf = np.stack([a**2 / (np.pi * (cos2 * (a**2 - 1) + 1) ** 2) for a in (0.05, 0.18, 0.5)])
    cosine = np.cos(masking_nodes())
    rise = (1 - np.cos(theta_d_centres())) ** 5
    return FactorModel(
        diffuse=np.array([0.08, 0.05, 0.03]),
        scale=np.array([[0.02, 0.018, 0.015], [0.05, 0.04, 0.05], [0.1, 0.12, 0.08]]),
        ndf=ndf,
        masking=np.stack(
            [
                2 * cosine / (cosine + np.sqrt(a**2 + (1 - a**2) * cosine**2))
                for a in (0.05, 0.18, 0.5)
            ]
        ),
        fresnel=np.stack([f0 + (1 - f0) * rise for f0 in (0.5, 0.4, 0.3)]),
    ).normalized()


def write(path: Path) -> None:
    """Write it as a MERL file."""
    merl.write(path, tabulate(model()), merl_bins().above_horizon)
