# SPDX-License-Identifier: GPL-3.0-or-later
"""Tensor files of our own making, in the adaptive parameterisation of Dupuy and Jakob 2018."""

import struct

import numpy as np

from fitter.formats import tensor_file
from fitter.formats.warps import Warp
from fitter.geometry import HALF_PI, normalized

WAVELENGTHS = np.arange(400, 701, 20, dtype="<f4")


def tensor_bytes(fields):
    """A tensor file of arrays by name."""
    header = tensor_file.MAGIC + bytes(tensor_file.VERSION) + struct.pack("<I", len(fields))
    size = len(header) + sum(2 + len(name) + 11 + 8 * a.ndim for name, a in fields.items())
    data = b""
    for name, array in fields.items():
        kind = 1 + tensor_file.DTYPES.index(array.dtype.str.replace("|", ""))
        header += struct.pack("<H", len(name)) + name.encode()
        header += struct.pack("<HBQ", array.ndim, kind, size + len(data))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        data += array.tobytes()
    return header + data


def glossy(incident, exitant, alpha=(0.3, 0.3)):
    """f_r (n,): a GGX lobe without masking on a diffuse base, along x and y of other widths."""
    m = normalized(incident + exitant)
    slope2 = (m[:, 0] / alpha[0]) ** 2 + (m[:, 1] / alpha[1]) ** 2 + m[:, 2] ** 2
    distribution = 1 / (np.pi * alpha[0] * alpha[1] * slope2**2)
    return 0.05 + distribution / (4 * (incident[:, 2] + exitant[:, 2]))


def fields_of(f_r, phi_i=(0.0,), *, spectral=False, jacobian=True, n=24, n_theta=7, width=0.5):
    """Fields of a file that holds f_r(incident, exitant) (n,), tinted by 1, 1/2 and 1/4.

    A spectral file has the same in three bands of WAVELENGTHS. The normals that it expects to see
    are within `width` radians or so.
    """
    isotropic = len(phi_i) < 3
    phi_i = np.asarray(phi_i, "<f4")
    theta_i = np.linspace(0, HALF_PI, n_theta, dtype="<f4")
    u = np.linspace(0, 1, 24)
    theta_m, phi_m = u**2 * HALF_PI, (2 * u - 1) * np.pi
    ndf = np.exp(-((theta_m / width) ** 2)) * np.ones((24, 1)) + 0.01
    sigma = np.cos(theta_m) * np.ones((24, 1)) + 0.05
    m = spherical(theta_m[None, :], phi_m[:, None])
    incident = spherical(theta_i[None, :], np.where(isotropic, 0, phi_i)[:, None])
    visible = np.einsum("ptx,yzx->ptyz", incident, m).clip(0) + 1e-3
    vndf = (visible * ndf * (u * np.sin(theta_m) + 1e-4 * width)).astype("<f4")

    grid = np.linspace(0, 1, n)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
    warp = Warp(vndf, (phi_i, theta_i))
    values = np.zeros((len(phi_i), n_theta, n, n))
    for p, t in np.ndindex(values.shape[:2]):
        parameters = (np.full(x.size, phi_i[p], float), np.full(x.size, theta_i[t], float))
        ux, uy = warp.sample(x, y, *parameters)
        half = spherical(ux**2 * HALF_PI, (2 * uy - 1) * np.pi)
        wi = np.broadcast_to(incident[p, t], half.shape)
        exitant = 2 * (wi * half).sum(-1, keepdims=True) * half - wi
        # at the horizon and below the table goes on as at a small cosine
        exitant[:, 2] = np.maximum(exitant[:, 2], 1e-3)
        wi = np.where([False, False, True], np.maximum(wi, 1e-3), wi)
        value = f_r(wi, exitant) * exitant[:, 2]
        if jacobian:
            value *= (
                4 * np.interp(np.sqrt(theta_i[t] / HALF_PI), u, sigma[0]) / np.interp(ux, u, ndf[0])
            )
        values[p, t] = value.reshape(n, n)
    return {
        "description": np.frombuffer(b"made by a test", "u1"),
        "theta_i": theta_i,
        "phi_i": phi_i,
        "ndf": ndf.astype("<f4"),
        "sigma": sigma.astype("<f4"),
        "vndf": vndf,
        "luminance": np.ones((len(phi_i), n_theta, n, n), "<f4"),
        "jacobian": np.array([jacobian], "u1"),
        **_coloured(values, spectral),
    }


def _coloured(values, spectral):
    if not spectral:
        tint = np.array([1, 0.5, 0.25])
        return {"rgb": (values[:, :, None] * tint[:, None, None]).astype("<f4")}
    tint = np.select([WAVELENGTHS < 500, WAVELENGTHS < 600], [0.25, 0.5], 1.0)
    spectra = (values[:, :, None] * tint[:, None, None]).astype("<f4")
    return {"wavelengths": WAVELENGTHS, "spectra": spectra}


def spherical(theta, phi):
    """Unit vectors (..., 3)."""
    sin = np.sin(theta)
    return np.stack(np.broadcast_arrays(sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)), -1)
