# SPDX-License-Identifier: GPL-3.0-or-later
import pytest

from fitter import merl, readers
from fitter.errors import MeasurementError


@pytest.mark.parametrize("name", ["copper.binary", "copper.bin", "copper.bsdf", "copper"])
def test_content_decides(measured, tmp_path, name):
    path = tmp_path / name
    path.symlink_to(measured)
    measurement = readers.read(path)
    assert (measurement.source.format, measurement.source.file_name) == ("merl", name)
    assert measurement.source.sha256 == merl.read(measured).source.sha256


@pytest.mark.parametrize("name", ["cut.binary", "cut.txt"])
def test_unknown_content_is_refused_by_the_reader_of_its_suffix(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"not a measurement")
    with pytest.raises(MeasurementError, match=rf"^{name}: 17 bytes, a MERL file has 34,992,012"):
        readers.read(path)


def test_folder(tmp_path):
    with pytest.raises(MeasurementError, match=r"a folder, not a regular file; .*\.binary"):
        readers.read(tmp_path)


def test_missing(tmp_path):
    with pytest.raises(MeasurementError, match=r"^gone\.binary: no such file"):
        readers.read(tmp_path / "gone.binary")
