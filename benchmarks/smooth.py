# SPDX-License-Identifier: GPL-3.0-or-later
"""Error of smooth and exact sampling without their noise: the residual blurred by its kernels.

Renders of them converge slowly where highlights are small. Here the residual f - base is integrated
against the map as each kernel blurs it: what the expectation of a picture is. The kernels are those
of osl/residual_lobe.osl.in, sampled with a few directions each; the residual is small, and so is
the noise of that.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from fitter.base_error import N_AZIMUTHS, N_RINGS, POINTS
from fitter.base_lobes import BaseLobes, fit_base_lobes
from fitter.geometry import normalized
from fitter.model import FactorModel
from fitter.quadrature import ViewQuadrature, view_quadrature
from fitter.sphere import rendered_psnr
from fitter.tables import lobe_albedo, sampling_tables, versine_nodes
from osl.generate import KERNELS_PER_DIRECTION

from . import shared_data
from .base import map_light
from .fit import environment_maps

# osl/residual_lobe.osl.in
COSINE_SHARE, UNIFORM_SHARE, LARGEST_EXPONENT = 0.2, 0.1, 1e5
DIRECTIONS = 6  # of each kernel
LIMIT = 0.005
SAMPLINGS = ("native", "smooth", "exact")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench smooth."""
    parser.add_argument("--every", type=int, default=6, metavar="N", help="each Nth material")
    parser.add_argument("--fits", metavar="DIR", type=Path, help="keeps fits, and uses them")


def run(arguments: argparse.Namespace) -> int:
    """Print a line for each material; returns 1 if smooth sampling misses LIMIT somewhere."""
    shared_data.require_shared()
    lights = [map_light(image) for image in environment_maps()]
    print("image L1 and PSNR against the model, mean of Grace and Grove")
    print(f"{'material':<28}" + "".join(f"{sampling:>18}" for sampling in SAMPLINGS))
    rows = []
    for name in shared_data.material_names()[:: arguments.every]:
        model = shared_data.fitted_material(name, arguments.fits).model
        row = np.mean([errors(model, fit_base_lobes(model), light) for light in lights], axis=0)
        rows.append(row)
        print(f"{name:<28}" + "".join(f"{e:10.2%} {p:5.1f} dB" for e, p in row), flush=True)
    rows = np.array(rows)
    print(f"{'mean':<28}" + "".join(f"{e:10.2%} {p:5.1f} dB" for e, p in rows.mean(0)))
    print(f"{'worst':<28}" + "".join(f"{e:10.2%}{'':9}" for e in rows[..., 0].max(0)))
    return int(rows[:, SAMPLINGS.index("smooth"), 0].max() > LIMIT)


def errors(model: FactorModel, base: BaseLobes, light: object) -> list[tuple[float, float]]:
    """Image L1 and PSNR of each of SAMPLINGS."""
    rng = np.random.default_rng(0)
    pictures = np.zeros((len(SAMPLINGS) + 1, N_RINGS, N_AZIMUTHS, 3))
    for ring in range(N_RINGS):
        theta = float(np.arcsin(np.sqrt((ring + 0.5) / N_RINGS)))
        view = view_quadrature(theta, *POINTS)
        wo = np.broadcast_to(view.wo, view.wi.shape)
        diffuse = model.diffuse * view.wi[:, 2:]
        exact = model.lobe_values(view.wi, wo).sum(0) * view.wi[:, 2:] + diffuse
        native = base.value(view.wi, view.wo) + diffuse
        density = _density(model, view)
        weight = view.solid_angle[:, None] / 2  # the quadrature holds half of the directions
        for step in range(N_AZIMUTHS):
            frame = _frame(theta, (step + ring % 2 / 2) / N_AZIMUTHS * 2 * np.pi)
            for side in (1, -1):
                wi = view.wi * [1, side, 1]
                sharp = light(wi @ frame)
                pictures[-1, ring, step] += (sharp * exact * weight).sum(0)
                pictures[0, ring, step] += (sharp * native * weight).sum(0)
                for index, sampling in enumerate(SAMPLINGS[1:], 1):
                    share = KERNELS_PER_DIRECTION[sampling] * 2 * np.pi
                    exponent = np.minimum(
                        share * np.maximum(density, 0.5 / np.pi), LARGEST_EXPONENT
                    )
                    blurred = _blurred(light, wi, exponent, frame, rng)
                    value = sharp * native + blurred * (exact - native)
                    pictures[index, ring, step] += (value * weight).sum(0)
    reference = pictures[-1].reshape(1, -1, 3)
    out = []
    for picture in pictures[:-1].reshape(len(SAMPLINGS), 1, -1, 3):
        difference = float(np.abs(picture - reference).sum() / reference.sum())
        out.append((difference, float(rendered_psnr(picture, reference)[0])))
    return out


def _density(model: FactorModel, view: ViewQuadrature) -> np.ndarray:
    """Density (n,), 1/sr, with which the shader draws each direction for the residual."""
    h = normalized(view.wi + view.wo)
    versine = ((h - [0, 0, 1]) ** 2).sum(1) / 2
    theta_o = np.arctan2(view.wo[0], view.wo[2])
    albedo = lobe_albedo(model, np.array([theta_o]), n_phi=24, n_per_bin=2)[0].mean(-1)
    share = albedo / albedo.sum()
    lobes = sum(
        weight * np.interp(versine, versine_nodes(), density)
        for weight, density in zip(share, sampling_tables(model).density, strict=True)
    )
    of_h = (1 - COSINE_SHARE - UNIFORM_SHARE) * lobes + UNIFORM_SHARE / (2 * np.pi)
    return of_h / (4 * (h @ view.wo)) + COSINE_SHARE * view.wi[:, 2] / np.pi


def _blurred(
    light: object,
    wi: np.ndarray,
    exponent: np.ndarray,
    frame: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Radiance (n, 3) around wi (n, 3), weighted with cos^exponent; none from below the horizon."""
    tangent = normalized(np.cross(wi, [0.3, 0.5, 0.8]))
    bitangent = np.cross(wi, tangent)
    total = np.zeros(wi.shape)
    for _ in range(DIRECTIONS):
        cosine = rng.random(len(wi)) ** (1 / (exponent + 1))
        phi = rng.random(len(wi)) * 2 * np.pi
        across = tangent * np.cos(phi)[:, None] + bitangent * np.sin(phi)[:, None]
        drawn = wi * cosine[:, None] + across * np.sqrt(1 - cosine**2)[:, None]
        total += light(drawn @ frame) * (drawn[:, 2:] > 0)
    return total / DIRECTIONS


def _frame(theta: float, azimuth: float) -> np.ndarray:
    """Rows tangent, bitangent, normal of a point of the sphere, seen along -z."""
    normal = np.array(
        [np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)]
    )
    tangent = normalized(np.array([0, 0, 1.0]) - normal * np.cos(theta))
    return np.stack([tangent, np.cross(normal, tangent), normal])
