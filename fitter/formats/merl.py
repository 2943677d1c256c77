# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the MERL database (Matusik et al. 2003): 90 x 90 x 180 bins, double precision.

Layout, little endian:

- 3 int32: the number of bins in theta_h, theta_d and phi_d, that is 90, 90, 180;
- 3 x 1,458,000 float64: all red values, then green, then blue, phi_d fastest, theta_h slowest.

The stored numbers are f_r divided by 1/1500 (red), 1.15/1500 (green) and 1.66/1500 (blue).
Negative numbers mark bins without a measurement. The grid also covers pairs of directions that do
not exist, with wi or wo below the horizon; files hold anything there, so these bins are found by
geometry and their content is ignored.
"""

from __future__ import annotations

import hashlib
import os

import numpy as np

from ..errors import MeasurementError
from ..geometry import N_PHI_D, N_THETA_D, N_THETA_H, merl_bins
from ..measurement import BinReport, Measurement, Source
from . import measured_file
from .measured_file import MeasuredFile, checked_name, opened

GRID = (N_THETA_H, N_THETA_D, N_PHI_D)
CHANNEL_SCALES = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
HEADER = np.array(GRID, dtype="<i4").tobytes()
FILE_SIZE = len(HEADER) + 3 * 8 * N_THETA_H * N_THETA_D * N_PHI_D
EXPECTED = "a MERL .binary file"


def recognises(head: bytes, size: int) -> bool:
    """Whether a file of this size starts like a MERL file, of the right resolution or not."""
    return size == FILE_SIZE or head.startswith(HEADER)


def read(path: str | os.PathLike) -> Measurement:
    """Read a MERL file; bins that hold no usable value are masked and counted.

    A bin counts once in the report: below the horizon, else not finite in some channel, else
    negative in some channel.

    Raises
    ------
    MeasurementError
        The file cannot be read, is not a MERL file, or holds nothing to fit.
    """
    with opened(path, EXPECTED) as file:
        return _read_open_file(file)


def write(path: str | os.PathLike, f_r: np.ndarray, valid: np.ndarray) -> None:
    """Write a MERL file, all or nothing: an existing file is replaced by a complete one or kept.

    Parameters
    ----------
    path
        File to write; its folder must exist.
    f_r
        (90, 90, 180, 3), 1/sr, linear RGB; finite and not negative where valid.
    valid
        (90, 90, 180) mask; the other bins are stored as -1.

    Raises
    ------
    MeasurementError
        The values cannot be stored, or the file cannot be written.
    """
    name = checked_name(path)
    f_r, valid = np.asarray(f_r), np.asarray(valid)
    if f_r.shape != (*GRID, 3) or valid.shape != GRID or valid.dtype != np.bool_:
        raise MeasurementError(
            f"{name}: f_r {f_r.shape} and valid {valid.shape} of {valid.dtype}, a MERL file needs "
            f"{(*GRID, 3)} and {GRID} of bool"
        )
    channels = [_stored_channel(f_r[..., c], valid, CHANNEL_SCALES[c], name) for c in range(3)]
    chunks = (np.ascontiguousarray(channel).data for channel in channels)
    measured_file.write(path, (HEADER, *chunks), EXPECTED)


def _read_open_file(file: MeasuredFile) -> Measurement:
    name = file.name
    header = file.stream.read(len(HEADER))
    if file.size != FILE_SIZE:
        raise _wrong_size(name, file.size, header)
    if header != HEADER:
        raise MeasurementError(
            f"{name}: the header says {_grid_text(header)} bins, a MERL file has "
            f"{_grid_text(HEADER)}; choose {EXPECTED}"
        )

    above_horizon = merl_bins().above_horizon
    finite = np.ones(GRID, dtype=bool)
    negative = np.zeros(GRID, dtype=bool)
    f_r = np.empty((*GRID, 3))
    digest = hashlib.sha256(header)
    channel = np.empty(GRID, dtype="<f8")
    for c in range(3):
        if file.stream.readinto(memoryview(channel).cast("B")) != channel.nbytes:
            raise MeasurementError(f"{name}: became shorter while it was read; try again")
        digest.update(channel)
        finite &= np.isfinite(channel)
        negative |= channel < 0
        f_r[..., c] = channel
    valid = above_horizon & finite & ~negative
    f_r[~valid] = 0
    f_r *= CHANNEL_SCALES

    report = BinReport(
        total=valid.size,
        below_horizon=int(np.count_nonzero(~above_horizon)),
        non_finite=int(np.count_nonzero(above_horizon & ~finite)),
        negative=int(np.count_nonzero(above_horizon & finite & negative)),
    )
    if not report.usable:
        raise MeasurementError(
            f"{name}: no usable bin ({report.negative:,} negative and {report.non_finite:,} not "
            f"finite above the horizon), a measurement has most of them; download it again"
        )
    if not f_r.any():
        raise MeasurementError(
            f"{name}: all {report.usable:,} usable bins are zero, nothing can be fitted to a "
            "perfectly black material; download it again"
        )
    for array in (f_r, valid):
        array.flags.writeable = False
    return Measurement(
        f_r=f_r,
        valid=valid,
        source=Source(file_name=file.stored_name, format="merl", sha256=digest.hexdigest()),
        report=report,
    )


def _wrong_size(name: str, size: int, header: bytes) -> MeasurementError:
    found = f"{name}: {size:,} bytes, a MERL file has {FILE_SIZE:,}"
    if len(header) < len(HEADER) or header == HEADER:
        return MeasurementError(f"{found}; download it again")
    grid = [int(n) for n in np.frombuffer(header, dtype="<i4")]
    if min(grid) > 0 and size == len(header) + 3 * 8 * grid[0] * grid[1] * grid[2]:
        return MeasurementError(
            f"{found}; it is complete, with {_grid_text(header)} bins, but only "
            f"{_grid_text(HEADER)} can be read: choose the file in the original resolution"
        )
    return MeasurementError(f"{found}; choose {EXPECTED}")


def _grid_text(header: bytes) -> str:
    return " x ".join(str(n) for n in np.frombuffer(header, dtype="<i4"))


def _stored_channel(f_r: np.ndarray, valid: np.ndarray, scale: float, name: str) -> np.ndarray:
    """One channel (90, 90, 180) as the file holds it."""
    with np.errstate(over="ignore", invalid="ignore"):
        stored = np.where(valid, f_r / scale, -1.0)
        bad = valid & ~(np.isfinite(stored) & (stored >= 0))
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        raise MeasurementError(
            f"{name}: {np.count_nonzero(bad):,} valid bins hold a negative or infinite value or "
            f"NaN, the first is {index} with {f_r[index]}; mark them as not valid"
        )
    return stored.astype("<f8", copy=False)
