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

from fitter.geometry import normalized
from fitter.models.model import FactorModel
from fitter.models.tables import lobe_albedo, sampling_tables, versine_nodes
from fitter.pictures.sphere import rendered_psnr
from fitter.quadrature import ViewQuadrature
from fitter.shading.base_error import N_AZIMUTHS, N_RINGS, sphere_rings
from fitter.shading.base_lobes import BaseLobes, fit_base_lobes
from osl.generate import (
    COSINE_SHARE,
    KERNELS_PER_DIRECTION,
    LARGEST_EXPONENT,
    UNIFORM_SHARE,
)

from . import shared_data
from .base import map_light
from .fit import environment_maps

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
    pictures = np.zeros((len(SAMPLINGS) + 1, N_RINGS, N_AZIMUTHS, 3))  # the model's is the last
    for index, ring in enumerate(sphere_rings()):
        values = _values(model, base, ring.view)
        exponents = _exponents(model, ring.view)
        weight = ring.view.solid_angle[:, None] / 2  # the quadrature holds half of the directions
        for step, frame in enumerate(ring.frames):
            for side in (1, -1):
                wi = ring.view.wi * [1, side, 1]
                reflected = _reflected(light, wi, frame, values, exponents, rng)
                pictures[:, index, step] += [(picture * weight).sum(0) for picture in reflected]
    *pictures, reference = pictures.reshape(len(pictures), 1, -1, 3)
    return [
        (
            float(np.abs(picture - reference).sum() / reference.sum()),
            float(rendered_psnr(picture, reference)[0]),
        )
        for picture in pictures
    ]


def _values(
    model: FactorModel, base: BaseLobes, view: ViewQuadrature
) -> tuple[np.ndarray, np.ndarray]:
    """Values f cos(theta_i) (n, 3), 1/sr, of the model and of native sampling."""
    diffuse = model.diffuse * view.wi[:, 2:]
    wo = np.broadcast_to(view.wo, view.wi.shape)
    exact = model.lobe_values(view.wi, wo).sum(0) * view.wi[:, 2:]
    return exact + diffuse, base.value(view.wi, view.wo) + diffuse


def _exponents(model: FactorModel, view: ViewQuadrature) -> list[np.ndarray]:
    """Exponents (n,) of the kernels of smooth and exact sampling at each direction."""
    density = np.maximum(_density(model, view), 0.5 / np.pi)
    return [
        np.minimum(KERNELS_PER_DIRECTION[sampling] * 2 * np.pi * density, LARGEST_EXPONENT)
        for sampling in SAMPLINGS[1:]
    ]


def _reflected(
    light: object,
    wi: np.ndarray,
    frame: np.ndarray,
    values: tuple[np.ndarray, np.ndarray],
    exponents: list[np.ndarray],
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """Light (n, 3) from wi (n, 3) that each of SAMPLINGS, and then the model, sends on."""
    exact, native = values
    sharp = light(wi @ frame)
    blurred = [_blurred(light, wi, exponent, frame, rng) for exponent in exponents]
    residual = exact - native
    return [sharp * native, *(sharp * native + b * residual for b in blurred), sharp * exact]


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
