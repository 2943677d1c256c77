# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of Blender's Principled BSDF that look like a fitted material: what it is compared with.

fitter/principled.py is a model with a free F90, fitted to measured bins like ours and graded
without rendering. This gives what the node takes, so that Cycles can render it.

The match is a least-squares fit of Lambert + GGX to f cos(theta_i) at three view angles,

    d_c cos(theta_i) / pi + F0_c ggx(alpha),

d_c, F0_c >= 0, one alpha for all channels, weighted by 1 / (value + 5 % of its mean + 0.2 % of its
largest) so that neither the peak nor the wide floor alone decides. F is constant in the match and
rises to 1 at grazing in Principled, which measured materials do not: a match that insists on it
gives up the peak instead. Principled then has roughness sqrt(alpha). For metals, and where Lambert
carries under a tenth of the fitted energy, the match is repeated without it: Metallic 1, base
colour F0. Otherwise Metallic 0, base colour d, the IOR that has the mean F0, and the specular tint
that gives F0 its colour.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitter.closures import Closure
from fitter.line_search import least_around_nodes
from fitter.nnls import solve_nonnegative
from fitter.quadrature import HalfVectors

VIEW_ANGLES = np.radians([10.0, 30.0, 50.0])
ALPHAS = np.geomspace(0.004, 1.0, 34)
METALLIC_BELOW = 0.1  # share of Lambert in the energy
LARGEST_F0 = 0.9
N_POLAR, N_AZIMUTH = 60, 24  # half vectors at each view angle


@dataclass(frozen=True)
class Inputs:
    """Inputs of the matched Principled BSDF.

    metallic : 0 or 1
    roughness : sqrt(alpha)
    base_color : (3,) 0..1
    ior, specular_tint : give the dielectric's F0; (3,) up to 1
    error : of the match, weighted RMS relative to the weighted RMS of the values
    """

    metallic: float
    roughness: float
    base_color: tuple[float, ...]
    ior: float
    specular_tint: tuple[float, ...]
    error: float


def match(f_r: Callable[[np.ndarray, np.ndarray], np.ndarray], *, metal: bool = False) -> Inputs:
    """Match a BRDF f_r(wi, wo) -> (n, 3), 1/sr.

    metal : known to be one; otherwise the share of Lambert decides
    """
    views = [_View(theta, f_r) for theta in VIEW_ANGLES]
    alpha, colors, error = _best_alpha(views, metallic=False)
    metallic = metal or _lambert_share(views, alpha, colors) < METALLIC_BELOW
    if metallic:
        alpha, colors, error = _best_alpha(views, metallic=True)
    diffuse, f0 = np.clip(colors[:, 0], 0, 1), np.clip(colors[:, 1], 0, LARGEST_F0)
    mean_f0 = max(float(f0.mean()), 1e-4)
    root = np.sqrt(mean_f0)
    return Inputs(
        metallic=float(metallic),
        roughness=float(np.sqrt(alpha)),
        base_color=tuple(map(float, f0 if metallic else diffuse)),
        ior=1.5 if metallic else float((1 + root) / (1 - root)),
        specular_tint=(1.0,) * 3 if metallic else tuple(map(float, np.minimum(f0 / mean_f0, 1))),
        error=error,
    )


def build(matched: Inputs) -> object:
    """The match as a Blender material."""
    import bpy

    material = bpy.data.materials.new("Principled")
    if material.node_tree is None:  # before Blender 5.0
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Metallic"].default_value = matched.metallic
    node.inputs["Roughness"].default_value = matched.roughness
    node.inputs["Base Color"].default_value = (*matched.base_color, 1)
    node.inputs["IOR"].default_value = matched.ior
    node.inputs["Specular Tint"].default_value = (*matched.specular_tint, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return material


class _View:
    """Quadrature over wi at one view angle: half vectors dense at the mirror direction."""

    def __init__(self, theta: float, f_r: Callable) -> None:
        # polar angle of h as the cube of an even grid: bins of 1e-5 degrees at the peak
        edge = np.linspace(0, 1, N_POLAR + 1)
        theta_h = ((edge[1:] + edge[:-1]) / 2) ** 3 * np.pi / 2
        width = np.diff(edge**3) * np.pi / 2
        ring = 2 * np.pi * np.sin(theta_h) * width
        view = HalfVectors.on_rings(theta_h, ring, N_AZIMUTH).at_view(theta)
        self.wi, self.wo, self.measure = view.wi, view.wo, view.solid_angle
        wo = np.broadcast_to(self.wo, self.wi.shape)
        self.target = (f_r(self.wi, wo) * self.wi[:, 2:]).T
        mean = (self.target * self.measure).sum(1) / self.measure.sum()
        floor = 0.05 * mean + 0.002 * self.target.max(1)
        self.weight = self.measure / np.maximum(self.target + floor[:, None], 1e-12)

    def columns(self, alpha: float) -> np.ndarray:
        """Values (2, n) of Lambert and of GGX without Fresnel."""
        ggx = Closure("ggx", alpha).columns(self.wi, self.wo).sum(0)
        return np.stack([self.wi[:, 2] / np.pi, ggx])


def _best_alpha(views: list[_View], *, metallic: bool) -> tuple[float, np.ndarray, float]:
    """Alpha, the colours (3, 2) of Lambert and F0, and the relative error."""

    def error(log_alpha: float) -> float:
        return _solve(views, np.exp(log_alpha), metallic)[1]

    alpha = float(np.exp(least_around_nodes(error, np.log(ALPHAS), tolerance=1e-4)))
    return alpha, *_solve(views, alpha, metallic)


def _solve(views: list[_View], alpha: float, metallic: bool) -> tuple[np.ndarray, float]:
    """Colours (3, 2) at one alpha, and the relative error."""
    matrix, right, total = np.zeros((3, 2, 2)), np.zeros((3, 2)), np.zeros(3)
    for view in views:
        basis = view.columns(alpha) * ([[0.0], [1.0]] if metallic else 1.0)
        matrix += np.einsum("cn,kn,ln->ckl", view.weight, basis, basis)
        right += np.einsum("cn,kn,cn->ck", view.weight, basis, view.target)
        total += (view.weight * view.target**2).sum(1)
    colors = solve_nonnegative(matrix, right)
    squared = total + np.einsum("ck,ckl,cl->c", colors, matrix, colors)
    squared -= 2 * (colors * right).sum(1)
    return colors, float(np.sqrt(max(squared.sum(), 0) / total.sum()))


def _lambert_share(views: list[_View], alpha: float, colors: np.ndarray) -> float:
    """Share of Lambert in the reflected energy of the match, mean of views and channels."""
    parts = sum(view.columns(alpha) @ view.measure for view in views) * colors.sum(0)
    return float(parts[0] / max(parts.sum(), 1e-12))
