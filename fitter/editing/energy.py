# SPDX-License-Identifier: GPL-3.0-or-later
"""An edited model within the light there is, and not darker than that asks for.

Where lobes and diffuse part together would reflect more than all light, G is lowered at the view
angles concerned. G stands in the reflectance twice: lowered by a share s everywhere, the lobes keep
s^2 of their light, lowered in a narrow range of angles little less than s. So it is lowered by the
square root of what is asked for, a few times over, and by what is left at the end. That is a
guarantee: lowering G elsewhere only lowers the albedo further.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import polar_grid
from ..fitting.limits import MOST_ALBEDO
from ..models import quick_albedo
from ..models.anisotropic_model import AnisotropicModel
from ..models.factors import AnyFactors
from ..models.model import FactorModel
from ..models.quick_albedo import Views, views_at
from ..models.splines import masking_nodes

ROUNDS = 6
LEAST_LIGHT = 1e-12  # keeps quotients finite
NEARLY_ALL = 0.99  # share that is left to the last step
ENOUGH_ROOM = 1.03  # room for this much at the coarse views is room at all others

# Of isotropic models: every 3 degrees while rounds go on, then every control point of G.
COARSE_VIEWS = views_at(np.radians([*range(0, 90, 3), 89.5]))
FINE_VIEWS = views_at(masking_nodes()[:-1])

# Of anisotropic ones: the rows of G and two angles beyond the last row, for which it stands, at
# every fourth azimuth of G while rounds go on, then at all of them.
POLAR_ANGLES = np.append(polar_grid.theta_nodes(), np.radians([82.5, 88.0]))
COARSE_STEP = 4


def _polar_views(step: int) -> Views:
    azimuths = polar_grid.phi_nodes()[::step].tolist()
    return tuple((theta, phi) for theta in POLAR_ANGLES.tolist() for phi in azimuths)


COARSE_POLAR_VIEWS, FINE_POLAR_VIEWS = _polar_views(COARSE_STEP), _polar_views(1)


def within_energy(model: AnyFactors) -> AnyFactors:
    """The model itself, or with G lowered where it would reflect more than all light."""
    is_polar = model.kind == "anisotropic"
    coarse = COARSE_POLAR_VIEWS if is_polar else COARSE_VIEWS
    fine = FINE_POLAR_VIEWS if is_polar else FINE_VIEWS
    limited, room = model, _room(model, coarse)
    # curves around may rise between the coarse azimuths as they like
    if room.min() > ENOUGH_ROOM and not is_polar:
        return model
    for _ in range(ROUNDS):
        if room.min() > NEARLY_ALL:
            break
        limited = _lowered(limited, coarse, np.sqrt(np.minimum(room, 1)))
        room = _room(limited, coarse)
    room = _room(limited, fine)
    return limited if room.min() >= 1 else _lowered(limited, fine, np.minimum(room, 1))


def _room(model: AnyFactors, views: Views) -> np.ndarray:
    """How many times (views,) the light of the lobes is what the diffuse part leaves room for."""
    lobes = quick_albedo.lobe_albedo(model, views).sum(1)
    room = np.maximum(MOST_ALBEDO - np.pi * model.diffuse, 0)
    return (room / np.maximum(lobes, LEAST_LIGHT)).min(1)


def _lowered(model: AnyFactors, views: Views, share: np.ndarray) -> AnyFactors:
    """The model with G times a share (views,) that is known at some views."""
    if model.kind == "isotropic":
        angles = np.array([theta for theta, _ in views])
        return _with_masking(model, np.interp(masking_nodes(), angles, share))
    rows = _at_all_azimuths(share.reshape(len(POLAR_ANGLES), -1))
    nodes = rows[: polar_grid.N_THETA].copy()
    nodes[-1] = np.minimum(nodes[-1], rows[polar_grid.N_THETA :].min(0))
    nodes[0] = nodes[0].min()  # the pole is one direction
    return _with_masking(model, nodes)


def _at_all_azimuths(rows: np.ndarray) -> np.ndarray:
    """Rows (k, azimuths), known at evenly spaced azimuths from 0, at those of G."""
    turn = 2 * np.pi
    known = np.arange(rows.shape[1]) / rows.shape[1] * turn
    return np.array([np.interp(polar_grid.phi_nodes(), known, row, period=turn) for row in rows])


def _with_masking(model: FactorModel | AnisotropicModel, share: np.ndarray) -> AnyFactors:
    return replace(model, masking=model.masking * share)
