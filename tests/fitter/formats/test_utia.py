# SPDX-License-Identifier: GPL-3.0-or-later
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fitter.errors import MeasurementError
from fitter.formats import readers, utia
from tests import exr_files

SHAPE = (6, 48, 6, 48, 3)


@pytest.fixture(scope="module")
def f_r():
    return np.random.default_rng(0).uniform(0.01, 3, SHAPE)


@pytest.fixture(scope="module")
def bin_file(tmp_path_factory, f_r):
    path = tmp_path_factory.mktemp("utia") / "cloth.bin"
    utia.write_bin(path, f_r)
    return path


@pytest.fixture(scope="module")
def write_exr():
    pytest.importorskip("OpenEXR")
    return exr_files.write_exr


def test_bin(bin_file, f_r):
    got = utia.read_bin(bin_file)
    np.testing.assert_array_equal(got.f_r, f_r)
    assert got.valid.all()
    assert (got.encoding, got.source.format) == ("linear", "utia-bin")
    assert got.source.file_name == "cloth.bin"
    assert len(got.source.sha256) == 64
    assert (got.report.total, got.report.usable) == (82944, 82944)
    assert not got.f_r.flags.writeable


def test_bin_is_ordered_by_plane_light_and_viewer(tmp_path):
    """Built by hand: plane, theta_i, phi_i, theta_o, phi_o; the last is the fastest."""
    values = np.full(3 * 288 * 288, 0.5)
    plane, theta_i, phi_i, theta_o, phi_o = 1, 2, 7, 5, 40
    values[(((plane * 6 + theta_i) * 48 + phi_i) * 6 + theta_o) * 48 + phi_o] = 9
    path = tmp_path / "one.bin"
    path.write_bytes(values.astype("<f8").tobytes())
    got = utia.read_bin(path).f_r
    assert got[theta_i, phi_i, theta_o, phi_o, plane] == 9
    assert (got == 9).sum() == 1


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ"])
def test_exr_of_any_type_and_compression(tmp_path, f_r, dtype, compression, write_exr):
    path = write_exr(tmp_path / "cloth.exr", f_r, dtype, compression)
    got = readers.read(path)
    assert (got.source.format, got.encoding) == ("utia-exr", "linear")
    np.testing.assert_array_equal(got.f_r, f_r.astype(dtype).astype(float))


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("compression", ["PXR24", "B44", "B44A", "DWAA", "DWAB"])
def test_exr_of_lossy_compression(tmp_path, f_r, dtype, compression, write_exr):
    """Noise is the worst there is for them; the positions must be right."""
    smooth = np.ones(f_r.shape) * np.linspace(0.1, 0.9, f_r.shape[0])[:, None, None, None, None]
    got = readers.read(write_exr(tmp_path / "cloth.exr", smooth, dtype, compression))
    np.testing.assert_allclose(got.f_r, smooth, rtol=0.05)


def test_exr_rows_are_light_and_columns_the_viewer(tmp_path, f_r, write_exr):
    got = utia.read_exr(write_exr(tmp_path / "a.exr", f_r)).f_r
    # row 2 * 48 + 7, column 5 * 48 + 40
    pixel = f_r.reshape(288, 288, 3)[103, 280]
    np.testing.assert_allclose(got[2, 7, 5, 40], pixel, rtol=1e-6)


def test_exr_channels_by_name_and_others_ignored(tmp_path, f_r, write_exr):
    more = {"A": np.full((288, 288), 7, np.float32), "Z": np.ones((288, 288), np.float16)}
    got = utia.read_exr(write_exr(tmp_path / "a.exr", f_r, names="RGB", **more))
    np.testing.assert_array_equal(got.f_r, f_r.astype(np.float32).astype(float))
    # the file's own order is alphabetical, whatever order they are written in
    swapped = utia.read_exr(write_exr(tmp_path / "b.exr", f_r[..., ::-1], names="BGR"))
    np.testing.assert_array_equal(swapped.f_r, got.f_r)


def srgb_140(value):
    x = value / 140
    return 100 * (x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4)


def test_encoding(bin_file, tmp_path, f_r):
    stored = np.full(SHAPE, 1.0)
    stored[0, 0, 0, 0] = (3.0, 70.0, 140.0)
    path = tmp_path / "encoded.bin"
    utia.write_bin(path, stored)
    got = readers.read(path, encoding="srgb-140")
    assert got.encoding == "srgb-140"
    expected = [srgb_140(x) for x in (3.0, 70.0, 140.0)]
    np.testing.assert_allclose(got.f_r[0, 0, 0, 0], expected, rtol=1e-12)
    assert expected[2] == pytest.approx(100)
    assert readers.read(path).encoding == "linear"


def test_negative_values_count_as_black(tmp_path, f_r):
    stored = f_r.copy()
    stored[1, 2, 3, 4] = (-0.1, 0.2, -0.3)
    stored[1, 2, 3, 5, 0] = -1e-9
    path = tmp_path / "noisy.bin"
    utia.write_bin(path, stored)
    for encoding in utia.ENCODINGS:
        got = utia.read_bin(path, encoding)
        assert got.report.negative == 2
        assert got.valid.all()
        assert got.f_r[1, 2, 3, 4, 0] == got.f_r[1, 2, 3, 4, 2] == 0
        assert got.f_r[1, 2, 3, 4, 1] > 0
        assert got.f_r.min() >= 0


def test_pairs_that_are_not_finite_are_masked(tmp_path, f_r):
    stored = np.moveaxis(f_r, -1, 0).copy()
    stored[0, 1, 2, 3, 4] = np.nan
    stored[2, 5, 0, 0, 0] = np.inf
    path = tmp_path / "holes.bin"
    path.write_bytes(stored.tobytes())
    got = utia.read_bin(path)
    assert (got.report.non_finite, got.report.usable) == (2, 82942)
    assert not got.valid[1, 2, 3, 4]
    assert not got.valid[5, 0, 0, 0]
    assert got.valid.sum() == 82942
    np.testing.assert_array_equal(got.f_r[1, 2, 3, 4], 0)


def test_exr_of_infinite_halves_is_masked(tmp_path, f_r, write_exr):
    large = f_r.copy()
    large[0, 0, 1, 1] = 1e6  # more than a half can hold
    got = utia.read_exr(write_exr(tmp_path / "a.exr", np.minimum(large, np.inf), np.float32))
    assert got.report.non_finite == 0
    with np.errstate(over="ignore"):
        got = utia.read_exr(write_exr(tmp_path / "b.exr", large, np.float16))
    assert got.report.non_finite == 1


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.full(SHAPE, np.nan), r"only 0 of 82,944 pairs .* are finite"),
        (np.zeros(SHAPE), "no value is above zero"),
        (np.full(SHAPE, -1.0), "no value is above zero"),
    ],
)
def test_nothing_to_fit(tmp_path, values, message):
    path = tmp_path / "empty.bin"
    path.write_bytes(np.moveaxis(values, -1, 0).tobytes())
    with pytest.raises(MeasurementError, match=rf"^empty\.bin: {message}"):
        readers.read(path)


def test_wrong_size(tmp_path, bin_file):
    path = tmp_path / "short.bin"
    path.write_bytes(bin_file.read_bytes()[:-8])
    with pytest.raises(MeasurementError, match=r"^short\.bin: 1,990,648 bytes, a UTIA \.bin"):
        readers.read(path)


def test_writing_refuses_what_cannot_be_read_back(tmp_path, f_r):
    for wrong in (f_r[1:], np.where(f_r > 1, np.nan, f_r)):
        with pytest.raises(MeasurementError, match="expected"):
            utia.write_bin(tmp_path / "a.bin", wrong)
    assert not list(tmp_path.iterdir())


# --- pictures from strangers ---


def patched(path, attribute, offset, value):
    """The bytes of a picture with one int32 of a header attribute changed."""
    content = bytearray(Path(path).read_bytes())
    start = content.index(attribute)
    start = content.index(b"\0", start + len(attribute) + 1) + 1 + 4 + offset
    content[start : start + 4] = struct.pack("<i", value)
    return bytes(content)


@pytest.fixture
def never_decoded(monkeypatch):
    def decode(*arguments):
        raise AssertionError("decoded before the header was checked")

    monkeypatch.setattr(utia, "_exr_pixels", decode)


@pytest.mark.parametrize(("offset", "value"), [(8, 2**31 - 1), (12, 100_000), (8, 3), (0, -5)])
def test_size_is_checked_before_decoding(tmp_path, f_r, never_decoded, offset, value, write_exr):
    path = write_exr(tmp_path / "bomb.exr", f_r)
    path.write_bytes(patched(path, b"dataWindow", offset, value))
    with pytest.raises(MeasurementError, match=r"^bomb\.exr: a picture of .* has 288 x 288"):
        readers.read(path)


def test_many_channels_are_refused_before_decoding(tmp_path, f_r, never_decoded, write_exr):
    more = {f"channel {n:04}": np.zeros((288, 288), np.float16) for n in range(100)}
    path = write_exr(tmp_path / "many.exr", f_r, **more)
    with pytest.raises(MeasurementError, match="very many channels"):
        readers.read(path)


def test_file_size_is_checked_first(tmp_path, never_decoded):
    path = tmp_path / "huge.exr"
    with path.open("wb") as file:
        file.write(utia.EXR_MAGIC)
        file.truncate(utia.MAX_EXR_SIZE + 1)
    with pytest.raises(MeasurementError, match=r"^huge\.exr: 16,777,217 bytes"):
        readers.read(path)


@pytest.mark.parametrize("flag", [0x200, 0x800, 0x1000])
def test_tiled_deep_and_multi_part_are_refused(tmp_path, f_r, never_decoded, flag, write_exr):
    content = bytearray(write_exr(tmp_path / "a.exr", f_r).read_bytes())
    content[4:8] = struct.pack("<i", 2 | flag)
    path = tmp_path / "odd.exr"
    path.write_bytes(content)
    with pytest.raises(MeasurementError, match="one flat picture"):
        readers.read(path)


def test_damaged_headers(tmp_path, f_r, never_decoded, write_exr):
    whole = write_exr(tmp_path / "a.exr", f_r).read_bytes()
    rng = np.random.default_rng(0)
    path = tmp_path / "cut.exr"
    for end in [4, 8, 9, *rng.integers(10, 300, 40)]:
        path.write_bytes(whole[: int(end)])
        with pytest.raises(MeasurementError, match=r"^cut\.exr: "):
            readers.read(path)


def test_damaged_pixels(tmp_path, f_r, write_exr, capfd):
    whole = write_exr(tmp_path / "a.exr", f_r).read_bytes()
    path = tmp_path / "cut.exr"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(MeasurementError, match=r"^cut\.exr: cannot be decoded .*Unable to "):
        readers.read(path)
    # the library prints there, with the path
    assert capfd.readouterr() == ("", "")


def test_missing_channel(tmp_path, f_r, write_exr):
    path = write_exr(tmp_path / "a.exr", f_r, names="RGY")
    with pytest.raises(MeasurementError, match=r"no channel B,"):
        readers.read(path)


def test_without_the_package(tmp_path, f_r, monkeypatch, write_exr):
    path = write_exr(tmp_path / "a.exr", f_r)
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(MeasurementError, match=r"needs the Python package OpenEXR.*\.bin file"):
        readers.read(path)


def test_synthetic_files_of_the_shared_tool(shared, tmp_path):
    """The two layouts of an independent writer hold the same numbers."""
    pytest.importorskip("OpenEXR")
    tool = shared / "tools" / "make_utia.py"
    both = [tmp_path / "cloth.bin", tmp_path / "cloth.exr"]
    command = [sys.executable, tool, both[0], "--exr", both[1], "--material", "twill"]
    subprocess.run([*map(str, command), "--negatives", "0.001"], check=True, capture_output=True)
    a, b = map(readers.read, both)
    np.testing.assert_allclose(b.f_r, a.f_r, rtol=1e-6, atol=1e-9)
    assert a.report == b.report
    assert a.report.negative > 50
