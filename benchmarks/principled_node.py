# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of Blender's Principled BSDF that look like a fitted material: what it is compared with.

fitter/baselines/principled.py is a model with a free F90, fitted to measured bins like ours and
graded without rendering. This gives what the node takes, so that Cycles can render it.

The match is a least-squares fit of Lambert + GGX to f cos(theta_i) at three view angles,

    d_c cos(theta_i) / pi + F0_c ggx(alpha),

d_c, F0_c >= 0, one alpha for all channels, weighted by 1 / (value + 5 % of its mean + 0.2 % of its
largest) so that neither the peak nor the wide floor alone decides. F is constant in the match and
rises to 1 at grazing in Principled, which measured materials do not: a match that insists on it
gives up the peak instead. Principled then has roughness sqrt(alpha). For metals, and where Lambert
carries under a tenth of the fitted energy, the match is repeated without it: Metallic 1, base
colour F0. Otherwise Metallic 0, base colour d, the IOR that has the mean F0, and the specular tint
that gives F0 its colour.

A material with a direction is matched over four azimuths of the viewer with two alphas, along its
tangent and across, which become Anisotropic and Anisotropic Rotation; its main direction has to be
one of the two, as those of the synthetic materials are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitter.line_search import least_around_nodes
from fitter.nnls import solve_nonnegative
from fitter.quadrature import HalfVectors
from fitter.shading.closures import Closure

VIEW_ANGLES = np.radians([10.0, 30.0, 50.0])
ALPHAS = np.geomspace(0.004, 1.0, 34)
METALLIC_BELOW = 0.1  # share of Lambert in the energy
LARGEST_F0 = 0.9
VIEW_AZIMUTHS = np.radians([0.0, 35.0, 90.0, 235.0])  # of a material with a direction
N_POLAR, N_AZIMUTH = 60, 24  # half vectors at each view, over half a turn
ROUNDS = 3  # of the searches for one alpha given the other
LOWEST_RATIO = 0.1  # of the alphas that Anisotropic can give


@dataclass(frozen=True)
class Inputs:
    """Inputs of the matched Principled BSDF.

    metallic : 0 or 1
    roughness : sqrt(alpha)
    base_color : (3,) 0..1
    ior, specular_tint : give the dielectric's F0; (3,) up to 1
    error : of the match, weighted RMS relative to the weighted RMS of the values
    anisotropic : 1 - alpha ratio over 0.9
    rotation : turns of the tangent, to the direction of the larger alpha
    """

    metallic: float
    roughness: float
    base_color: tuple[float, ...]
    ior: float
    specular_tint: tuple[float, ...]
    error: float
    anisotropic: float = 0.0
    rotation: float = 0.0


def match(
    f_r: Callable[[np.ndarray, np.ndarray], np.ndarray],
    *,
    metal: bool = False,
    directed: bool = False,
) -> Inputs:
    """Match a BRDF f_r(wi, wo) -> (n, 3), 1/sr.

    metal : known to be one; otherwise the share of Lambert decides
    directed : with two alphas
    """
    azimuths = VIEW_AZIMUTHS if directed else VIEW_AZIMUTHS[:1]
    views = [_View(theta, phi, f_r, directed) for theta in VIEW_ANGLES for phi in azimuths]
    alphas, colors, error = _best_alphas(views, directed, metallic=False)
    metallic = metal or _lambert_share(views, alphas, colors) < METALLIC_BELOW
    if metallic:
        alphas, colors, error = _best_alphas(views, directed, metallic=True)
    ratio = max(min(alphas) / max(alphas), LOWEST_RATIO)
    diffuse, f0 = np.clip(colors[:, 0], 0, 1), np.clip(colors[:, 1], 0, LARGEST_F0)
    mean_f0 = max(float(f0.mean()), 1e-4)
    root = np.sqrt(mean_f0)
    return Inputs(
        metallic=float(metallic),
        # alpha along and across are roughness^2 over and times the root of their ratio
        roughness=float((alphas[0] * alphas[1]) ** 0.25),
        base_color=tuple(map(float, f0 if metallic else diffuse)),
        ior=1.5 if metallic else float((1 + root) / (1 - root)),
        specular_tint=(1.0,) * 3 if metallic else tuple(map(float, np.minimum(f0 / mean_f0, 1))),
        error=error,
        anisotropic=(1 - ratio) / 0.9,
        rotation=0.25 if alphas[0] < alphas[1] else 0.0,
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
    node.inputs["Anisotropic"].default_value = matched.anisotropic
    node.inputs["Anisotropic Rotation"].default_value = matched.rotation
    if matched.anisotropic:
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.axis = "RADIAL", "Z"
        tree.links.new(tangent.outputs["Tangent"], node.inputs["Tangent"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return material


class _View:
    """Quadrature over wi at one view: half vectors dense at the mirror direction."""

    def __init__(self, theta: float, phi: float, f_r: Callable, directed: bool) -> None:
        # polar angle of h as the cube of an even grid: bins of 1e-5 degrees at the peak
        edge = np.linspace(0, 1, N_POLAR + 1)
        theta_h = ((edge[1:] + edge[:-1]) / 2) ** 3 * np.pi / 2
        width = np.diff(edge**3) * np.pi / 2
        ring = 2 * np.pi * np.sin(theta_h) * width
        halves = 2 if directed else 1
        half_vectors = HalfVectors.on_rings(theta_h, ring, halves * N_AZIMUTH, halves * np.pi)
        view = half_vectors.at_view(theta).turned(phi)
        self.wi, self.wo, self.measure = view.wi, view.wo, view.solid_angle
        wo = np.broadcast_to(self.wo, self.wi.shape)
        self.target = (f_r(self.wi, wo) * self.wi[:, 2:]).T
        mean = (self.target * self.measure).sum(1) / self.measure.sum()
        floor = 0.05 * mean + 0.002 * self.target.max(1)
        self.weight = self.measure / np.maximum(self.target + floor[:, None], 1e-12)

    def columns(self, alphas: tuple[float, float]) -> np.ndarray:
        """Values (2, n) of Lambert and of GGX without Fresnel."""
        ggx = Closure("ggx", alphas[0], across=alphas[1]).columns(self.wi, self.wo).sum(0)
        return np.stack([self.wi[:, 2] / np.pi, ggx])


def _best_alphas(
    views: list[_View], directed: bool, *, metallic: bool
) -> tuple[tuple[float, float], np.ndarray, float]:
    """Alphas along and across, the colours (3, 2) of Lambert and F0, and the relative error."""

    def best(alphas_of: Callable[[float], tuple[float, float]]) -> float:
        def error(log_alpha: float) -> float:
            return _solve(views, alphas_of(float(np.exp(log_alpha))), metallic)[1]

        return float(np.exp(least_around_nodes(error, np.log(ALPHAS), tolerance=1e-4)))

    along = across = best(lambda alpha: (alpha, alpha))
    for _ in range(ROUNDS if directed else 0):
        along = best(lambda alpha, other=across: (alpha, other))
        across = best(lambda alpha, other=along: (other, alpha))
    return (along, across), *_solve(views, (along, across), metallic)


def _solve(
    views: list[_View], alphas: tuple[float, float], metallic: bool
) -> tuple[np.ndarray, float]:
    """Colours (3, 2) at two alphas, and the relative error."""
    matrix, right, total = np.zeros((3, 2, 2)), np.zeros((3, 2)), np.zeros(3)
    for view in views:
        basis = view.columns(alphas) * ([[0.0], [1.0]] if metallic else 1.0)
        matrix += np.einsum("cn,kn,ln->ckl", view.weight, basis, basis)
        right += np.einsum("cn,kn,cn->ck", view.weight, basis, view.target)
        total += (view.weight * view.target**2).sum(1)
    colors = solve_nonnegative(matrix, right)
    squared = total + np.einsum("ck,ckl,cl->c", colors, matrix, colors)
    squared -= 2 * (colors * right).sum(1)
    return colors, float(np.sqrt(max(squared.sum(), 0) / total.sum()))


def _lambert_share(views: list[_View], alphas: tuple[float, float], colors: np.ndarray) -> float:
    """Share of Lambert in the reflected energy of the match, mean of views and channels."""
    parts = sum(view.columns(alphas) @ view.measure for view in views) * colors.sum(0)
    return float(parts[0] / max(parts.sum(), 1e-12))
