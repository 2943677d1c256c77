# SPDX-License-Identifier: GPL-3.0-or-later
"""A material that is exactly a FactorModel: what a perfect fit would recover."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fitter import polar_grid
from fitter.formats import merl, utia
from fitter.geometry import merl_bins, theta_d_centres, theta_h_centres
from fitter.grading import anisotropic_metrics
from fitter.grading.metrics import tabulate
from fitter.models.anisotropic_model import AnisotropicModel
from fitter.models.model import FactorModel
from fitter.models.splines import masking_nodes


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


def anisotropic_model() -> AnisotropicModel:
    """Three GGX-like lobes of two roughnesses each on the UTIA grid, F as above."""
    alphas = ((0.2, 0.5), (0.5, 0.3), (0.8, 0.8))
    nodes = polar_grid.directions()
    x2, y2, z2 = (nodes**2).T
    return AnisotropicModel(
        diffuse=model().diffuse,
        scale=np.array([[0.2, 0.18, 0.15], [0.1, 0.08, 0.1], [0.1, 0.12, 0.08]]),
        fresnel=model().fresnel,
        ndf=np.stack(
            [1 / (np.pi * a * b * (x2 / a**2 + y2 / b**2 + z2) ** 2) for a, b in alphas]
        ).reshape(3, 6, 48),
        masking=np.stack(
            [2 / (1 + np.sqrt(1 + (x2 * a**2 + y2 * b**2) / z2)) for a, b in alphas]
        ).reshape(3, 6, 48),
    ).normalized()


def write_anisotropic(path: Path) -> None:
    """Write it as a UTIA .bin file."""
    utia.write_bin(path, anisotropic_metrics.tabulate(anisotropic_model()))


def write(path: Path) -> None:
    """Write it as a MERL file."""
    merl.write(path, tabulate(model()), merl_bins().above_horizon)
