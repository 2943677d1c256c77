# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import os
import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from fitter import errors, geometry
from fitter.errors import MeasurementError
from fitter.formats import merl
from runner.environment import CHECKOUT
from tests import rights

SIZE = 34_992_012
N_BINS = 1_458_000


@pytest.fixture(scope="module")
def above():
    return geometry.merl_bins().above_horizon


@pytest.fixture(scope="module")
def stored():
    """Numbers of a good file (3, 90, 90, 180), all different, every bin filled."""
    values = np.random.default_rng(0).uniform(1, 1000, (3, 90, 90, 180))
    values.flags.writeable = False
    return values


@pytest.fixture
def make_file(tmp_path):
    """Write a file by hand, not by merl.write; 35 MB each, so removed after the test."""
    paths = []

    def make(stored, header=(90, 90, 180), name="gold.binary", extra=b""):
        path = tmp_path / name
        paths.append(path)
        with path.open("wb") as file:
            file.write(struct.pack("<3i", *header))
            file.write(np.broadcast_to(stored, (3, 90, 90, 180)).astype("<f8").tobytes())
            file.write(extra)
        return path

    yield make
    for path in paths:
        path.unlink(missing_ok=True)


@pytest.fixture
def target(tmp_path):
    path = tmp_path / "out.binary"
    yield path
    path.unlink(missing_ok=True)


# --- reading ---


def test_hand_packed_bytes_give_scaled_values(tmp_path, above):
    path = tmp_path / "hand.binary"
    bin_index = (3, 20, 40)
    assert above[bin_index]
    flat = (3 * 90 + 20) * 180 + 40
    with path.open("wb") as file:
        file.write(struct.pack("<iii", 90, 90, 180))
        file.truncate(SIZE)
        for channel, value in enumerate((1500.0, 3000.0, 4500.0)):
            file.seek(12 + 8 * (channel * N_BINS + flat))
            file.write(struct.pack("<d", value))
    measurement = merl.read(path)
    path.unlink()
    np.testing.assert_allclose(
        measurement.f_r[bin_index], [1.0, 2 * 1.15, 3 * 1.66], rtol=1e-15, atol=0
    )
    assert np.count_nonzero(measurement.f_r) == 3


def test_read_a_good_file(make_file, stored, above):
    path = make_file(stored)
    measurement = merl.read(str(path))
    assert measurement.f_r.shape == (90, 90, 180, 3)
    assert measurement.f_r.dtype == np.float64
    assert measurement.f_r.flags.c_contiguous
    np.testing.assert_array_equal(measurement.valid, above)
    expected = np.moveaxis(stored, 0, -1) * [1 / 1500, 1.15 / 1500, 1.66 / 1500]
    np.testing.assert_allclose(measurement.f_r[above], expected[above], rtol=1e-14)
    assert (measurement.f_r[~above] == 0).all()
    report = measurement.report
    assert (report.total, report.negative, report.non_finite) == (N_BINS, 0, 0)
    assert report.below_horizon == np.count_nonzero(~above)
    assert report.usable == np.count_nonzero(above)
    assert measurement.source.file_name == "gold.binary"
    assert measurement.source.format == "merl"
    assert measurement.source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_unusable_bins_are_masked_and_counted_once(make_file, stored, above):
    values = stored.copy()
    inside = np.argwhere(above)[::1000]
    outside = np.argwhere(~above)[::1000]
    values[(0, *inside[0])] = -1
    values[(2, *inside[1])] = -1e-30
    values[(1, *inside[2])] = np.nan
    values[(0, *inside[3])] = np.inf
    values[(1, *inside[4])] = -np.inf
    values[(0, *inside[5])], values[(1, *inside[5])] = -1, np.nan  # both: not finite
    for channel, junk in enumerate((np.nan, -5, 1e300)):
        values[(channel, *outside[channel])] = junk
    measurement = merl.read(make_file(values))
    assert measurement.report.negative == 2
    assert measurement.report.non_finite == 4
    assert measurement.report.below_horizon == np.count_nonzero(~above)
    assert measurement.report.usable == np.count_nonzero(above) - 6
    assert np.count_nonzero(measurement.valid) == measurement.report.usable
    for index in inside[:6]:
        assert not measurement.valid[tuple(index)]
        assert (measurement.f_r[tuple(index)] == 0).all()
    assert measurement.valid[tuple(inside[6])]
    assert np.isfinite(measurement.f_r).all()


def test_below_horizon_values_are_ignored(make_file, stored, above):
    clean = merl.read(make_file(stored))
    for junk in (-1.0, np.nan, 7e250):
        got = merl.read(make_file(np.where(above, stored, junk)))
        np.testing.assert_array_equal(got.f_r, clean.f_r)
        np.testing.assert_array_equal(got.valid, clean.valid)
        assert got.report == clean.report


def test_zero_is_a_measurement(make_file, stored, above):
    values = stored.copy()
    index = tuple(np.argwhere(above)[500])
    values[(slice(None), *index)] = 0
    assert merl.read(make_file(values)).valid[index]


def test_lookup_gives_the_value_of_the_bin(make_file, stored, above):
    measurement = merl.read(make_file(stored))
    rng = np.random.default_rng(1)
    bins = np.argwhere(above)[rng.integers(0, np.count_nonzero(above), 2000)]
    i, j, k = bins.T
    # anywhere inside the bin, and at any azimuth of h
    shift = rng.uniform(-0.45, 0.45, (3, 2000))
    wi, wo = geometry.directions_from_rusinkiewicz(
        geometry.theta_h_from_index(i + 0.5 + shift[0]),
        np.radians(j + 0.5 + shift[1]),
        np.radians(k + 0.5 + shift[2]),
    )
    expected = (stored[:, i, j, k] * np.array([[1.0], [1.15], [1.66]]) / 1500).T
    np.testing.assert_allclose(measurement.lookup(wi, wo), expected, rtol=1e-14)
    np.testing.assert_allclose(measurement.lookup(wo, wi), expected, rtol=1e-14)


def test_lookup_is_zero_in_invalid_bins(make_file, stored, above):
    values = stored.copy()
    values[0, 0, 10, 20] = -1
    wi, wo = geometry.directions_from_rusinkiewicz(
        geometry.theta_h_centres()[:1], np.radians(10.5), np.radians(20.5)
    )
    np.testing.assert_array_equal(merl.read(make_file(values)).lookup(wi, wo), np.zeros((1, 3)))


def test_memory_stays_near_the_result(make_file, stored):
    path = make_file(stored)
    tracemalloc.start()
    merl.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.5 * SIZE


# --- files that cannot be used ---


def fails(path, *words):
    with pytest.raises(MeasurementError) as caught:
        merl.read(path)
    message = str(caught.value)
    for word in words:
        assert word in message
    assert "\n" not in message
    assert message.isprintable()
    return message


@pytest.mark.parametrize("size", [0, 5, 12, 34_992_000, SIZE - 1, SIZE + 1, 69_984_012])
def test_wrong_size(tmp_path, size):
    path = tmp_path / "gold.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 180)[:size])
    os.truncate(path, size)  # sparse
    message = fails(path)
    assert message == f"gold.binary: {size:,} bytes, a MERL file has 34,992,012; download it again"


def test_wrong_size_is_found_before_anything_large_is_read(tmp_path):
    path = tmp_path / "huge.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 180))
    try:
        os.truncate(path, 2**36)
    except OSError:
        os.truncate(path, 2**30)
    tracemalloc.start()
    fails(path, "a MERL file has 34,992,012")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    path.unlink()
    assert peak < 1e6


def test_other_grid_that_is_complete_is_named(tmp_path):
    path = tmp_path / "half.binary"
    path.write_bytes(struct.pack("<3i", 45, 45, 90) + bytes(8 * 3 * 45 * 45 * 90))
    fails(path, "half.binary: ", "45 x 45 x 90 bins", "only 90 x 90 x 180 can be read")


def test_other_file_is_not_worth_a_download(tmp_path):
    path = tmp_path / "picture.binary"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    assert "choose a MERL .binary file" in fails(path, "108 bytes")


@pytest.mark.parametrize("header", [(90, 180, 90), (90, 90, 360), (-1, 0, 2**31 - 1)])
def test_wrong_header(make_file, stored, header):
    grid = " x ".join(map(str, header))
    fails(make_file(stored, header), f"the header says {grid} bins", "has 90 x 90 x 180")


def test_big_endian_header(tmp_path):
    path = tmp_path / "gold.binary"
    path.write_bytes(struct.pack(">3i", 90, 90, 180))
    os.truncate(path, SIZE)
    fails(path, "header")


@pytest.mark.parametrize("value", [-1.0, np.nan])
def test_no_usable_bin(make_file, value):
    fails(make_file(value), "no usable bin", "1,096,216")


def test_only_below_the_horizon_is_no_usable_bin(make_file, stored, above):
    fails(make_file(np.where(above, -1.0, stored)), "no usable bin")


def test_all_zero(make_file, above):
    fails(make_file(np.where(above, 0.0, 7.0)), "1,096,216 usable bins are zero")


def test_missing(tmp_path):
    fails(tmp_path / "gone.binary", "gone.binary: no such file")


def test_folder(tmp_path):
    fails(tmp_path, f"{tmp_path.name}: a folder, not a regular file")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_fifo_does_not_hang(tmp_path):
    path = tmp_path / "pipe.binary"
    os.mkfifo(path)
    code = (
        "import sys\n"
        "from fitter.formats import merl\n"
        "try:\n"
        "    merl.read(sys.argv[1])\n"
        "except merl.MeasurementError as error:\n"
        "    sys.stdout.write(str(error))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)],
        cwd=CHECKOUT,
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert done.stdout.startswith("pipe.binary: a pipe or device, not a regular file"), done.stderr


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs /dev/zero")
def test_device():
    fails("/dev/zero", "not a regular file")


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs the permissions of Unix")
def test_unreadable(tmp_path):
    path = tmp_path / "secret.binary"
    path.write_bytes(b"")
    with rights.without(path, 0):
        fails(path, "secret.binary: cannot be read", "permissions")


def test_error_of_the_system_is_a_measurement_error(tmp_path):
    fails(tmp_path / ("x" * 5000), "cannot be read")


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("two\nlines.binary", r"two\nlines.binary: "),
        ("\x1b[31mred.binary", r"\x1b[31mred.binary: "),
        ("quo\"te's.binary", r"quo\"te\'s.binary: "),
        ("back\u202eward.binary", r"back\u202eward.binary: "),
        ("gr\u00fcn \u91d1.binary", "gr\u00fcn \u91d1.binary: "),
    ],
)
def test_names_of_strangers_are_shown_escaped(tmp_path, name, shown):
    assert fails(tmp_path / name).startswith(shown)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="file names are text there")
def test_name_that_is_not_utf8(tmp_path, stored, make_file):
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/gold\xff.binary"))
    assert fails(path).startswith(r"gold\udcff.binary: ")
    measurement = merl.read(make_file(stored, name=path.name))
    assert measurement.source.file_name == "gold\ufffd.binary"


def test_null_character(tmp_path):
    path = str(tmp_path / "a\0b")
    fails(path, r"a\x00b: a file name cannot hold a null character")
    with pytest.raises(MeasurementError, match="null character"):
        merl.write(path, *flat_values())


def test_shown_name_of_odd_paths():
    assert errors.shown_name("/") == "/"
    assert errors.shown_name("/some/folder/gold.binary") == "gold.binary"
    assert errors.shown_name(b"/some/gold.binary") == "gold.binary"
    assert errors.shown_name("") == ""


# --- writing ---


def flat_values():
    return np.ones((90, 90, 180, 3)), np.ones((90, 90, 180), dtype=bool)


def test_round_trip(target, above):
    rng = np.random.default_rng(2)
    valid = above & (rng.random(above.shape) < 0.9)
    f_r = rng.lognormal(0, 3, (*above.shape, 3))
    f_r[~valid] = np.nan  # never looked at
    before = f_r.copy()
    merl.write(target, f_r, valid)
    np.testing.assert_array_equal(f_r, before)
    measurement = merl.read(target)
    np.testing.assert_array_equal(measurement.valid, valid)
    np.testing.assert_allclose(measurement.f_r[valid], f_r[valid], rtol=1e-15)
    assert measurement.report.negative == np.count_nonzero(above & ~valid)


def test_written_bytes(target):
    f_r, valid = flat_values()
    f_r[0, 0, 1] = [2.0, 3.0, 4.0]
    valid[89, 89, 179] = False
    merl.write(target, f_r, valid)
    data = target.read_bytes()
    assert len(data) == SIZE
    assert struct.unpack_from("<3i", data) == (90, 90, 180)
    for channel, expected in enumerate((2 * 1500, 3 * 1500 / 1.15, 4 * 1500 / 1.66)):
        start = 12 + 8 * channel * N_BINS
        assert struct.unpack_from("<d", data, start + 8)[0] == pytest.approx(expected, rel=1e-15)
        assert struct.unpack_from("<d", data, start + 8 * (N_BINS - 1)) == (-1.0,)


@pytest.mark.parametrize("bad", [-1e-9, np.nan, np.inf, 1.7e308])
def test_bad_values_leave_the_old_file(target, bad):
    target.write_text("old")
    f_r, valid = flat_values()
    f_r[1, 2, 3, 1] = bad
    with pytest.raises(MeasurementError, match=r"out\.binary: 1 valid bins .*\(1, 2, 3\)"):
        merl.write(target, f_r, valid)
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.parametrize(
    ("f_r", "valid"),
    [
        (np.ones((90, 90, 180)), np.ones((90, 90, 180), bool)),
        (np.ones((90, 90, 180, 3)), np.ones((90, 90), bool)),
        (np.ones((90, 90, 180, 3)), np.ones((90, 90, 180))),
    ],
)
def test_wrong_shapes(target, f_r, valid):
    with pytest.raises(MeasurementError, match="a MERL file needs"):
        merl.write(target, f_r, valid)
    assert not target.exists()


def test_failed_replace_leaves_the_old_file(target, monkeypatch):
    target.write_text("old")

    def refuse(self, other):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(MeasurementError, match=r"out\.binary: cannot be written"):
        merl.write(target, *flat_values())
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.skipif(sys.platform == "win32", reason="needs resource limits")
def test_full_disk_leaves_the_old_file(target):
    import resource

    target.write_text("old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    arguments = flat_values()
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000_000, hard))
    try:
        with pytest.raises(MeasurementError, match="cannot be written"):
            merl.write(target, *arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]


def test_written_file_replaces_the_old_one_and_leaves_nothing_else(target):
    target.write_text("old")
    merl.write(str(target), *flat_values())
    assert target.stat().st_size == SIZE
    assert list(target.parent.iterdir()) == [target]


def test_write_does_not_replace_a_folder_or_device(tmp_path):
    with pytest.raises(MeasurementError, match="not a regular file"):
        merl.write(tmp_path, *flat_values())
    if hasattr(os, "mkfifo"):
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        with pytest.raises(MeasurementError, match="not a regular file"):
            merl.write(pipe, *flat_values())
        assert pipe.is_fifo()


def test_write_into_a_missing_folder(tmp_path):
    with pytest.raises(MeasurementError, match="cannot be written"):
        merl.write(tmp_path / "gone" / "out.binary", *flat_values())
