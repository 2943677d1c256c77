# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist changes about a fitted model: curves by hand, and sliders that mean something.

An edited model is a model like any other. Reciprocity therefore holds whatever is done to the
factors, and every number stays finite and not negative. A slider at its neutral value, and a curve
that is as it was drawn, change no bit of the model.

Two things need no new model, because the shader takes them as inputs: the gain of a lobe, and the
colour of the diffuse part (`diffuse_map`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..geometry import theta_d_centres
from ..models.anisotropy import anisotropy
from ..models.factors import N_LOBES, AnyFactors, Factors
from . import curves, polar_curves, stretching
from .curves import CURVES_OF, Heights

# Luminance of linear RGB, ITU-R BT.709.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# Haze is the lobe itself, so many times as wide.
HAZE_WIDTH = 4.0

# How the edge fades in towards grazing: (1 - cos theta_d)^2, a quarter at 60 degrees.
EDGE_POWER = 2


# What each slider may be, for the interface and for files.
RANGES = {
    "width": (0.1, 10.0),
    "width_along": (0.1, 10.0),
    "width_across": (0.1, 10.0),
    "haze": (0.0, 1.0),
    "falloff": (0.0, 4.0),
    "gain": (0.0, 100.0),
    "edge_tint": (0.0, 1.0),
    "edge_strength": (0.0, 10.0),
    "specular_saturation": (0.0, 4.0),
    "specular_hue": (-np.pi, np.pi),
    "diffuse_saturation": (0.0, 4.0),
    "diffuse_hue": (-np.pi, np.pi),
}


@dataclass(frozen=True)
class LobeSliders:
    """Sliders of one lobe; the defaults change nothing.

    width : stretches the highlight; the lobe keeps its light
    width_along, width_across : the same along the material's main direction and across it, which
        an isotropic lobe does not have
    haze : share of the light, 0 to 1, that moves from the highlight to a veil around it
    falloff : power of G; above 1 the lobe fades towards grazing, below 1 it holds
    gain : factor of the lobe
    """

    width: float = 1.0
    width_along: float = 1.0
    width_across: float = 1.0
    haze: float = 0.0
    falloff: float = 1.0
    gain: float = 1.0


@dataclass(frozen=True)
class Sliders:
    """All sliders of a material; the defaults change nothing.

    edge_tint : (3,) colour that F is multiplied by at grazing
    edge_strength : factor of F at grazing
    specular_saturation, diffuse_saturation : 0 is grey, 1 as measured
    specular_hue, diffuse_hue : turn around the grey axis, radians
    """

    lobes: tuple[LobeSliders, ...] = (LobeSliders(),) * N_LOBES
    edge_tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    edge_strength: float = 1.0
    specular_saturation: float = 1.0
    specular_hue: float = 0.0
    diffuse_saturation: float = 1.0
    diffuse_hue: float = 0.0

    def for_model(self) -> Sliders:
        """Those that change the model: the ones the shader has as inputs are neutral."""
        lobes = tuple(replace(lobe, gain=1.0) for lobe in self.lobes)
        return replace(self, lobes=lobes, diffuse_saturation=1.0, diffuse_hue=0.0)


@dataclass(frozen=True)
class Edits:
    """Curves as they were drawn and as they are now, and the sliders.

    before, after : heights (90,) by the name of a curve; one that is not in both changes nothing
    """

    before: Heights = field(default_factory=dict)
    after: Heights = field(default_factory=dict)
    sliders: Sliders = field(default_factory=Sliders)

    def changes(self, name: str) -> bool:
        """Whether a curve is not as it was drawn."""
        before, after = self.before.get(name), self.after.get(name)
        return before is not None and after is not None and not np.array_equal(before, after)


def apply(model: AnyFactors, edits: Edits) -> AnyFactors:
    """The edited model, without gains and without the diffuse colour's edits."""
    edited = [name for name in CURVES_OF[model.kind] if edits.changes(name)]
    if edited:
        bent = drawn(model)
        before = bent | {name: edits.before[name] for name in edited}
        after = bent | {name: edits.after[name] for name in edited}
        model = _BENDS[model.kind](model, before, after)
    direction = _main_direction(model)
    for lobe, sliders in enumerate(edits.sliders.lobes):
        model = _edit_lobe(model, lobe, sliders, direction)
    return _edit_specular_color(_edit_edge(model, edits.sliders), edits.sliders)


def drawn(model: Factors) -> Heights:
    """The factors of a model as heights (90,) by the name of a curve."""
    return polar_curves.drawn(model) if model.kind == "anisotropic" else curves.drawn(model)


_BENDS = {"isotropic": curves.bend, "anisotropic": polar_curves.bend}


def color_matrix(saturation: float, hue: float) -> np.ndarray:
    """Linear map (3, 3) of colours: a turn around the grey axis, then towards grey.

    Greys stay as they are. Exactly the identity for saturation 1 and hue 0.
    """
    matrix = np.eye(3)
    if hue:
        axis = np.full((3, 3), 1 / 3)
        cross = np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]]) / np.sqrt(3)
        matrix = axis + np.cos(hue) * (np.eye(3) - axis) + np.sin(hue) * cross
    if saturation != 1:
        matrix = (saturation * np.eye(3) + (1 - saturation) * LUMINANCE) @ matrix
    return matrix


def _main_direction(model: Factors) -> float:
    """Azimuth along which Width Along acts, radians; 0 where there is none."""
    return np.radians(anisotropy(model).direction) if model.kind == "anisotropic" else 0.0


def _edit_lobe(model: AnyFactors, lobe: int, sliders: LobeSliders, direction: float) -> AnyFactors:
    ndf, masking = model.ndf.copy(), model.masking.copy()
    along, across = sliders.width, sliders.width
    if model.kind == "anisotropic":
        along, across = along * sliders.width_along, across * sliders.width_across
    if (along, across) != (1, 1):
        ndf[lobe] = stretching.stretched(model, lobe, along, across, direction)
        model = replace(model, ndf=ndf)
    if sliders.haze != 0:
        veil = stretching.stretched(model, lobe, HAZE_WIDTH, HAZE_WIDTH)
        ndf[lobe] = (1 - sliders.haze) * model.ndf[lobe] + sliders.haze * veil
        model = replace(model, ndf=ndf)
    if sliders.falloff != 1:
        masking[lobe] = model.masking[lobe] ** sliders.falloff
        if model.kind == "isotropic":  # of others the horizon is no node
            masking[lobe, -1] = model.masking[lobe, -1]
        model = replace(model, masking=masking)
    return model


def _edit_edge(model: AnyFactors, sliders: Sliders) -> AnyFactors:
    edge = sliders.edge_strength * np.array(sliders.edge_tint)
    if (edge == 1).all():
        return model
    share = (1 - np.cos(theta_d_centres())) ** EDGE_POWER
    return replace(model, fresnel=model.fresnel * (1 + (edge[:, None] - 1) * share))


def _edit_specular_color(model: AnyFactors, sliders: Sliders) -> AnyFactors:
    """Saturation and hue of the lobes.

    A lobe's colour is s F. F is shared by the lobes, so it takes on their mean colour before it is
    mapped; how the lobes differ from it is mapped for itself.
    """
    matrix = color_matrix(sliders.specular_saturation, sliders.specular_hue)
    mean = model.scale.mean(0)
    if (matrix == np.eye(3)).all() or not mean.any():
        return model
    fresnel = np.maximum(matrix @ (mean[:, None] * model.fresnel), 0)
    own = model.scale / np.where(mean > 0, mean, 1) * (mean > 0)
    scale = np.maximum(own @ matrix.T, 0)
    return replace(model, scale=scale, fresnel=fresnel)
