# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the UTIA BRDF database (Filip and Vavra 2014): the grid of polar_grid, light by viewer.

- `.bin`: no header; 3 x 6 x 48 x 6 x 48 float64, little endian: all red values, then green, then
  blue, each by theta_i, phi_i, theta_o and, fastest, phi_o;
- `.exr`: the same as a picture of 288 x 288 pixels, a row for each direction of light (theta_i the
  slower) and a column for each of the viewer. Any compression, half or float channels R, G and B in
  any order; further channels are ignored.

The encoding of the numbers is not in the files, and public readers differ. `linear`, the default,
takes them as f_r in 1/sr. `srgb-140` divides by 140, decodes the sRGB curve and multiplies by 100.

Negative values, which noise leaves in dark pairs, count as 0; pairs that are not finite are masked.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
from collections.abc import Callable, Iterator
from types import ModuleType

import numpy as np

from .. import polar_grid
from ..anisotropic_measurement import AnisotropicMeasurement, ClampReport
from ..errors import MeasurementError, printable
from ..measurement import Source
from . import measured_file
from .measured_file import MeasuredFile, checked_name, opened

GRID = (*polar_grid.GRID, *polar_grid.GRID)
SIDE = polar_grid.N_NODES
FILE_SIZE = 3 * 8 * SIDE * SIDE
EXPECTED = "a UTIA .bin file or OpenEXR picture"

EXR_MAGIC = b"\x76\x2f\x31\x01"
# Float channels without compression are 1 MB; nothing honest comes near this.
MAX_EXR_SIZE = 16 << 20
# A header is a few hundred bytes; more than this is not read in search of its end.
MAX_HEADER_SIZE = 64 << 10
# A channel takes 18 bytes and its name; a picture may have a few besides R, G and B.
MAX_CHANNEL_LIST = 2048


def _srgb_140(stored: np.ndarray) -> np.ndarray:
    value = stored / 140
    decoded = np.where(value <= 0.04045, value / 12.92, (np.abs(value + 0.055) / 1.055) ** 2.4)
    return 100 * decoded


ENCODINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": lambda stored: stored,
    "srgb-140": _srgb_140,
}
DEFAULT_ENCODING = "linear"


def recognises_bin(head: bytes, size: int) -> bool:
    """Whether a file has the size of a .bin, which is all that it can be known by."""
    return size == FILE_SIZE


def recognises_exr(head: bytes, size: int) -> bool:
    """Whether a file starts like OpenEXR."""
    return head.startswith(EXR_MAGIC)


def read_bin(path: str | os.PathLike, encoding: str = DEFAULT_ENCODING) -> AnisotropicMeasurement:
    """Read a UTIA .bin file.

    encoding : a name in ENCODINGS

    Raises
    ------
    MeasurementError
        The file cannot be read, is not of this format, or holds nothing to fit.
    """
    with opened(path, EXPECTED) as file:
        if file.size != FILE_SIZE:
            raise MeasurementError(
                f"{file.name}: {file.size:,} bytes, a UTIA .bin file has {FILE_SIZE:,}; "
                f"choose {EXPECTED}"
            )
        content = _content(file)
        planes = np.frombuffer(content, "<f8").reshape(3, SIDE, SIDE)
        return _measurement(file, "utia-bin", content, np.moveaxis(planes, 0, -1), encoding)


def read_exr(path: str | os.PathLike, encoding: str = DEFAULT_ENCODING) -> AnisotropicMeasurement:
    """Read a UTIA OpenEXR picture.

    encoding : a name in ENCODINGS

    Raises
    ------
    MeasurementError
        As read_bin; also where the package OpenEXR is missing.
    """
    with opened(path, EXPECTED) as file:
        if file.size > MAX_EXR_SIZE:
            raise MeasurementError(
                f"{file.name}: {file.size:,} bytes, a picture of {SIDE} x {SIDE} pixels has less "
                f"than {MAX_EXR_SIZE:,}; choose {EXPECTED}"
            )
        content = _content(file)
        # before anything is decoded: a small file can claim to be a huge picture
        _check_exr_header(content, file.name)
        return _measurement(file, "utia-exr", content, _exr_pixels(path, file.name), encoding)


def write_bin(path: str | os.PathLike, f_r: np.ndarray) -> None:
    """Write a .bin file of f_r (6, 48, 6, 48, 3), linear, 1/sr; all or nothing.

    Raises
    ------
    MeasurementError
        The values cannot be stored, or the file cannot be written.
    """
    name = checked_name(path)
    if f_r.shape != (*GRID, 3) or not np.isfinite(f_r).all():
        raise MeasurementError(f"{name}: f_r {f_r.shape}, expected {(*GRID, 3)}, all finite")
    planes = np.ascontiguousarray(np.moveaxis(f_r, -1, 0), dtype="<f8")
    measured_file.write(path, [planes.data], EXPECTED)


def _content(file: MeasuredFile) -> bytes:
    content = file.stream.read(file.size)
    if len(content) != file.size:
        raise MeasurementError(f"{file.name}: became shorter while it was read; try again")
    return content


# a signalling NaN of a spoiled file would else be told at a cast; what is not finite is masked
@np.errstate(invalid="ignore")
def _measurement(
    file: MeasuredFile, format_name: str, content: bytes, stored: np.ndarray, encoding: str
) -> AnisotropicMeasurement:
    """Decode, mask and count stored values (288, 288, 3)."""
    stored = np.asarray(stored, dtype=np.float64)
    finite = np.isfinite(stored).all(-1)
    with np.errstate(over="ignore", invalid="ignore"):
        f_r = ENCODINGS[encoding](stored)
    finite &= np.isfinite(f_r).all(-1)
    f_r = np.where(finite[..., None], f_r, 0)
    negative = (f_r < 0).any(-1)
    f_r = np.maximum(f_r, 0)
    report = ClampReport(
        total=finite.size,
        negative=int(np.count_nonzero(negative)),
        non_finite=int(np.count_nonzero(~finite)),
    )
    _check_usable(f_r, report, file.name)
    f_r, valid = f_r.reshape(*GRID, 3), finite.reshape(GRID)
    for array in (f_r, valid):
        array.flags.writeable = False
    sha256 = hashlib.sha256(content).hexdigest()
    source = Source(file_name=file.stored_name, format=format_name, sha256=sha256)
    return AnisotropicMeasurement(f_r, valid, source, report, encoding)


def _check_usable(f_r: np.ndarray, report: ClampReport, name: str) -> None:
    if report.usable < report.total / 2:
        raise MeasurementError(
            f"{name}: only {report.usable:,} of {report.total:,} pairs of directions are finite, a "
            "measurement has most of them; download it again"
        )
    if not f_r.any():
        raise MeasurementError(
            f"{name}: no value is above zero, nothing can be fitted to a perfectly black "
            "material; download it again"
        )


def _check_exr_header(content: bytes, name: str) -> None:
    """Refuse what is not one flat picture of the right size, from the header alone."""
    version = int.from_bytes(content[4:8], "little")
    # bits 9, 11 and 12: tiles, deep data, several parts
    if version & 0xFF != 2 or version & 0x1A00:
        raise MeasurementError(
            f"{name}: tiled, deep or multi-part OpenEXR; save it as one flat picture"
        )
    attributes = dict(_exr_attributes(content[8:MAX_HEADER_SIZE], name))
    box = np.frombuffer(attributes.get("dataWindow", b"").ljust(16, b"\0")[:16], "<i4").astype(int)
    width, height = box[2] - box[0] + 1, box[3] - box[1] + 1
    if (width, height) != (SIDE, SIDE):
        raise MeasurementError(
            f"{name}: a picture of {width} x {height} pixels, a UTIA mosaic has {SIDE} x {SIDE}; "
            f"choose {EXPECTED}"
        )
    if len(attributes.get("channels", b"")) > MAX_CHANNEL_LIST:
        raise MeasurementError(
            f"{name}: a picture of very many channels, a UTIA mosaic has R, G and B; "
            f"choose {EXPECTED}"
        )


def _exr_attributes(header: bytes, name: str) -> list[tuple[str, bytes]]:
    """Name and value of every attribute of a single-part header."""
    attributes, position = [], 0
    while position < len(header) and header[position] != 0:
        end = header.find(b"\0", position)
        type_end = header.find(b"\0", end + 1)
        size = int.from_bytes(header[type_end + 1 : type_end + 5], "little")
        start = type_end + 5
        if min(end, type_end) < 0 or start + size > len(header):
            break
        attributes.append((header[position:end].decode("latin-1"), header[start : start + size]))
        position = start + size
    else:
        if position < len(header):
            return attributes
    raise MeasurementError(f"{name}: the OpenEXR header is damaged; download it again")


def _exr_pixels(path: str | os.PathLike, name: str) -> np.ndarray:
    """Pixels (288, 288, 3) of a picture whose header was checked."""
    openexr = _openexr(name)
    with _chatter() as printed:
        try:
            with openexr.File(os.fsdecode(path), separate_channels=True) as picture:
                channels = {key: channel.pixels for key, channel in picture.channels().items()}
        except Exception as error:
            # the library raises RuntimeError, and whatever numpy says to what it returns; where
            # pixels are damaged it prints why and goes on without the picture
            reason = printed.getvalue().rpartition(" - ")[2] or str(error) or type(error).__name__
            reason = reason.replace(os.fsdecode(path), "the file")
            raise MeasurementError(
                f"{name}: cannot be decoded as OpenEXR ({printable(reason.splitlines()[0])}); "
                "download it again"
            ) from None
    missing = [key for key in "RGB" if key not in channels]
    if missing:
        raise MeasurementError(
            f"{name}: there is no channel {' or '.join(missing)}, a UTIA mosaic has R, G and B; "
            f"choose {EXPECTED}"
        )
    planes = [channels[key] for key in "RGB"]
    if any(plane.shape != (SIDE, SIDE) for plane in planes):
        raise MeasurementError(f"{name}: channels of different sizes; choose {EXPECTED}")
    return np.stack(planes, -1)


@contextlib.contextmanager
def _chatter() -> Iterator[io.StringIO]:
    """What the library prints in Python. What it writes to stderr, with the path, is hidden."""
    printed = io.StringIO()
    with contextlib.ExitStack() as stack:
        # a Blender without a console may have no stderr
        with contextlib.suppress(OSError):
            kept = os.dup(2)
            stack.callback(os.close, kept)
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 2)
            os.close(nowhere)
            stack.callback(os.dup2, kept, 2)
        stack.enter_context(contextlib.redirect_stdout(printed))
        yield printed


def _openexr(name: str) -> ModuleType:
    try:
        import OpenEXR
    except ImportError:
        raise MeasurementError(
            f"{name}: reading OpenEXR needs the Python package OpenEXR, which this Python lacks; "
            "use the .bin file, or install the package"
        ) from None
    return OpenEXR
