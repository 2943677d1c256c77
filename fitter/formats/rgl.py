# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the RGL material database (Dupuy and Jakob 2018), NAME_rgb.bsdf and NAME_spec.bsdf.

A file is a tensor file (tensor_file.py) with these fields of float32, where not said otherwise:

- theta_i (t,) and phi_i (p,), radians: the directions of incidence;
- ndf (*, *), sigma (*, *), vndf (p, t, *, *): the microfacet model of adaptive_brdf.py;
- rgb (p, t, 3, n, n): the measurement in linear sRGB, or, in its place, spectra (p, t, w, n, n)
  at wavelengths (w,) in nm;
- jacobian (1,) uint8: whether rgb or spectra are divided by the Jacobian of the model;
- description uint8: text; luminance and valid, which evaluation does not need.

Up to two nodes of phi_i make an isotropic file.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass

import numpy as np

from ..anisotropic_measurement import AnisotropicMeasurement
from ..errors import MeasurementError
from ..measurement import Measurement, Source
from . import resampling, tensor_file
from .adaptive_brdf import AdaptiveBrdf
from .cie1931 import srgb_from_reflectance
from .measured_file import opened
from .tensor_file import EXPECTED
from .warps import SquareTable, Warp

ANISOTROPIC_FROM = 3  # nodes of phi_i

Fields = dict[str, np.ndarray]


@dataclass(frozen=True)
class RglFile:
    """What a file holds."""

    brdf: AdaptiveBrdf
    source: Source


def recognises(head: bytes, _size: int) -> bool:
    """Whether a file starts like a tensor file."""
    return tensor_file.recognises(head)


def read(path: str | os.PathLike) -> Measurement | AnisotropicMeasurement:
    """Read a file and tabulate it: isotropic on MERL's grid, anisotropic on UTIA's (resampling.py).

    Raises
    ------
    MeasurementError
        The file cannot be read, is no RGL file, or holds nothing to fit.
    """
    file = load(path)
    tabulate = resampling.to_merl_grid if file.brdf.isotropic else resampling.to_utia_grid
    return tabulate(file.brdf.f_r, file.source)


def load(path: str | os.PathLike) -> RglFile:
    """Read a file, isotropic or anisotropic, to evaluate it as it is.

    Raises
    ------
    MeasurementError
        The file cannot be read or is no RGL file.
    """
    with opened(path, EXPECTED) as file:
        content = tensor_file.read_content(file)
        brdf = from_fields(tensor_file.parse(content, file.name), file.name)
        sha256 = hashlib.sha256(content).hexdigest()
        return RglFile(brdf, Source(file_name=file.stored_name, format="rgl", sha256=sha256))


# a signalling NaN of a spoiled file would else be told at every cast; what is not finite is checked
@np.errstate(invalid="ignore")
def from_fields(fields: Fields, name: str) -> AdaptiveBrdf:
    """The BRDF in the fields of a tensor file.

    name : of the file, for messages

    Raises
    ------
    MeasurementError
        A field is missing or not as it has to be.
    """
    theta_i, phi_i = (_nodes(fields, key, name) for key in ("theta_i", "phi_i"))
    measured = "spectra" if "wavelengths" in fields else "rgb"
    per_direction = (len(phi_i), len(theta_i))
    ndf, sigma = (_field(fields, key, (None, None), name) for key in ("ndf", "sigma"))
    vndf = _field(fields, "vndf", (*per_direction, None, None), name)
    jacobian = _field(fields, "jacobian", (1,), name, kind="u")
    channels = 3
    if measured == "spectra":
        wavelengths = _nodes(fields, "wavelengths", name)
        channels = len(wavelengths)
    values = _field(fields, measured, (*per_direction, channels, None, None), name)
    for key, table in (("ndf", ndf), ("sigma", sigma), ("vndf", vndf)):
        if not (np.isfinite(table).all() and (table >= 0).all()):
            raise MeasurementError(
                f'{name}: field "{key}" holds negative or infinite numbers or NaN, which no '
                "distribution does; download it again"
            )
    if measured == "spectra":
        values = _converted(values, srgb_from_reflectance(wavelengths))
    nodes = (phi_i, theta_i)
    return AdaptiveBrdf(
        ndf=SquareTable(ndf),
        sigma=SquareTable(sigma),
        vndf=Warp(vndf, nodes),
        rgb=SquareTable(np.moveaxis(values, 2, -1), nodes),
        isotropic=len(phi_i) < ANISOTROPIC_FROM,
        reduction=_reduction(phi_i, name),
        jacobian=bool(jacobian[0]),
    )


def _field(
    fields: Fields, key: str, shape: tuple[int | None, ...], name: str, kind: str = "f"
) -> np.ndarray:
    """A field of this shape, where None is any number from 2, and kind of number."""
    if key not in fields:
        raise MeasurementError(f'{name}: has no field "{key}"; choose {EXPECTED}')
    found = fields[key]
    fits = len(found.shape) == len(shape) and all(
        n == wanted if wanted is not None else n >= 2
        for n, wanted in zip(found.shape, shape, strict=True)
    )
    if not fits or found.dtype.kind != kind:
        wanted_text = " x ".join("any" if n is None else str(n) for n in shape)
        found_text = " x ".join(map(str, found.shape))
        raise MeasurementError(
            f'{name}: field "{key}" is {found_text} of {found.dtype.name}, expected {wanted_text} '
            f"of {'float32' if kind == 'f' else 'uint8'}; choose {EXPECTED}"
        )
    return found


def _nodes(fields: Fields, key: str, name: str) -> np.ndarray:
    """A field (n,) of increasing finite numbers, as float64."""
    found = fields.get(key, np.empty((0, 0)))
    nodes = _field(fields, key, (found.shape[0],), name).astype(np.float64)
    if not (np.isfinite(nodes).all() and (np.diff(nodes) > 0).all()):
        raise MeasurementError(f'{name}: field "{key}" does not increase; download it again')
    return nodes


def _reduction(phi_i: np.ndarray, name: str) -> int:
    """How many times the range of phi_i of an anisotropic file fits into the circle."""
    if len(phi_i) < ANISOTROPIC_FROM:
        return 1
    span = phi_i[-1] - phi_i[0]
    reduction = round(2 * np.pi / span)
    if reduction not in (1, 2, 4):
        raise MeasurementError(
            f'{name}: field "phi_i" spans {np.degrees(span):.3g} degrees, expected 360, 180 or 90; '
            f"choose {EXPECTED}"
        )
    return reduction


def _converted(spectra: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Spectra (p, t, w, n, n) times a matrix (3, w): (p, t, 3, n, n).

    Colour is linear, so it is the same to convert the nodes and to convert what lies between.
    """
    n_phi, n_theta, n_wavelengths, height, width = spectra.shape
    rgb = np.empty((n_phi, n_theta, 3, height, width))
    for index in np.ndindex(n_phi, n_theta):
        rgb[index] = (matrix @ spectra[index].reshape(n_wavelengths, -1)).reshape(3, height, width)
    return rgb
