# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a fit must stay: energy near that of the data, no values far beyond the data's."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from ..geometry import merl_bins
from ..measurement import Measurement
from ..models.model import FactorModel
from ..models.splines import masking_nodes
from ..models.tables import lobe_albedo
from .albedo import measured_albedo

# An albedo up to this between the view angles looked at does not exceed 1 in between.
SAFE_ALBEDO = 0.97

# What it is lowered to: leaves a margin for the spline between nodes, and for quadratures.
MOST_ALBEDO = 0.995


@dataclass(frozen=True)
class Limits:
    """Figures of one fit.

    albedo_error : largest relative difference of the directional albedo, over what was measured,
        for channels and albedo.VIEW_ANGLES; the share of the light that falls on bins without a
        measurement is left out of both
    peak_ratio : largest value of the fit above the horizon over the largest of the data
    """

    albedo_error: float
    peak_ratio: float

    def figures(self) -> dict[str, float]:
        """The figures by name."""
        return asdict(self)


def limits(table: np.ndarray, measurement: Measurement) -> Limits:
    """Figures of a fit's table (90, 90, 180, 3), 1/sr, from `metrics.tabulate`."""
    fitted, measured = (
        measured_albedo(table, measurement),
        measured_albedo(measurement.f_r, measurement),
    )
    above = merl_bins().above_horizon
    return Limits(
        albedo_error=float(np.max(np.abs(fitted - measured) / measured)),
        peak_ratio=float(table[above].max() / measurement.f_r.max()),
    )


def within_energy(model: FactorModel, **quadrature: int) -> FactorModel:
    """The model, or one that reflects no more than all light at any view angle.

    Where the albedo exceeds 1, which happens only near grazing and where there is hardly data, the
    lobes get what the diffuse part leaves: every G is lowered at the view angles concerned. That
    lowers the albedo elsewhere too, so one pass is enough.

    quadrature : of lobe_albedo
    """
    looked_at = np.append(np.arange(0, 88, 4.0), 89.0)
    albedo = lobe_albedo(model, np.radians(looked_at), **quadrature).sum(1)
    if (albedo + np.pi * model.diffuse).max() <= SAFE_ALBEDO:
        return model
    lobes = lobe_albedo(model, masking_nodes()[:-1], **quadrature).sum(1)
    room = np.maximum(MOST_ALBEDO - np.pi * model.diffuse, 0)
    share = np.minimum(room / np.maximum(lobes, np.finfo(float).tiny), 1).min(1)
    masking = model.masking * np.append(share, share[-1])
    return replace(model, masking=masking).normalized()
