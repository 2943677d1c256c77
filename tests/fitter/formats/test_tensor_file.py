# SPDX-License-Identifier: GPL-3.0-or-later
import struct

import numpy as np
import pytest

from fitter.errors import MeasurementError
from fitter.formats import tensor_file
from fitter.formats.measured_file import opened
from tests.rgl_files import tensor_bytes

FIELDS = {
    "numbers": np.arange(24, dtype="<f4").reshape(2, 3, 4),
    "text": np.frombuffer(b"hello", "u1"),
    "long": np.array([2**60], "<u8"),
}


def header(version=(1, 0), n_fields=1):
    return tensor_file.MAGIC + bytes(version) + struct.pack("<I", n_fields)


def field(name=b"x", n_dimensions=1, kind=10, offset=64, shape=(1,)):
    head = struct.pack("<H", len(name)) + name + struct.pack("<HBQ", n_dimensions, kind, offset)
    return head + struct.pack(f"<{len(shape)}Q", *shape)


def padded(content, size=128):
    return content + bytes(size - len(content))


def test_fields_come_back():
    fields = tensor_file.parse(tensor_bytes(FIELDS), "a.bsdf")
    assert list(fields) == list(FIELDS)
    for name, array in FIELDS.items():
        np.testing.assert_array_equal(fields[name], array)
        assert fields[name].dtype == array.dtype


@pytest.mark.parametrize("dtype", tensor_file.DTYPES)
def test_every_type(dtype):
    array = np.array([0, 1, 100], dtype)
    (back,) = tensor_file.parse(tensor_bytes({"a": array}), "a.bsdf").values()
    np.testing.assert_array_equal(back, array)


def test_fields_are_views():
    content = tensor_bytes(FIELDS)
    numbers = tensor_file.parse(content, "a.bsdf")["numbers"]
    assert np.shares_memory(numbers, np.frombuffer(content, "u1"))
    assert not numbers.flags.writeable


def test_every_cut_is_refused():
    content = tensor_bytes(FIELDS)
    for size in range(len(content)):
        with pytest.raises(MeasurementError, match=r"^cut\.bsdf: "):
            tensor_file.parse(content[:size], "cut.bsdf")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "does not begin"),
        (padded(b"tensor_life\0"), "does not begin"),
        (padded(header(version=(2, 0))), r"version 2\.0 of the tensor format, only 1\.0"),
        (padded(header(n_fields=2**32 - 1)), "4,294,967,295 fields, expected at most 64"),
        (padded(header() + field(kind=0)), "unknown type 0"),
        (padded(header() + field(kind=12)), "unknown type 12"),
        (padded(header() + field(n_dimensions=9, shape=(1,) * 9), 256), "9 dimensions"),
        (padded(header() + field(offset=2**64 - 1)), "beyond the end"),
        (padded(header() + field(offset=125)), "beyond the end"),
        (padded(header() + field(n_dimensions=2, shape=(2**63, 2))), "beyond the end"),
        (padded(header() + field(n_dimensions=2, shape=(2**32, 2**32))), "beyond the end"),
        (padded(header() + field(n_dimensions=2, shape=(2**63, 0))), "is empty"),
        (padded(header() + field(name=b"\n\x1b[2J", kind=0)), r'field "\\n\\x1b\[2J" is of'),
        (padded(header() + field(name=b"x" * 60, kind=0)), f'field "{"x" * 40}" is of'),
    ],
)
def test_hostile_lists_of_fields(content, message):
    with pytest.raises(MeasurementError, match=message):
        tensor_file.parse(content, "bad.bsdf")


def test_many_fields_on_the_same_bytes_take_no_memory():
    names = [f"f{n:02d}".encode() for n in range(tensor_file.MAX_FIELDS)]
    size = 1 << 20
    content = padded(
        header(n_fields=len(names))
        + b"".join(field(name, kind=1, offset=0, shape=(size,)) for name in names),
        size,
    )
    fields = tensor_file.parse(content, "a.bsdf")
    whole = np.frombuffer(content, "u1")
    assert len(fields) == len(names)
    assert all(np.shares_memory(array, whole) for array in fields.values())


def test_sparse_giants_are_not_read(tmp_path):
    path = tmp_path / "giant.bsdf"
    with path.open("wb") as file:
        file.write(header())
        file.truncate(tensor_file.MAX_SIZE + 1)
    with (
        opened(path, "a file") as file,
        pytest.raises(
            MeasurementError, match="2,147,483,649 bytes, expected at most 2,147,483,648"
        ),
    ):
        tensor_file.read_content(file)


def test_file_that_shrinks(tmp_path):
    path = tmp_path / "a.bsdf"
    path.write_bytes(tensor_bytes(FIELDS))
    with opened(path, "a file") as file:
        path.write_bytes(b"short")
        with pytest.raises(MeasurementError, match="became shorter"):
            tensor_file.read_content(file)
