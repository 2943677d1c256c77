# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter.errors import MeasurementError
from fitter.formats import merl, readers, utia


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


@pytest.fixture
def cloth(tmp_path):
    path = tmp_path / "cloth.dat"
    utia.write_bin(path, np.full((6, 48, 6, 48, 3), 0.3))
    return path


def test_utia_is_known_by_its_size(cloth):
    assert readers.read(cloth).source.format == "utia-bin"


@pytest.mark.parametrize("name", ["cut.bin", "cut.exr"])
def test_unknown_content_with_a_suffix_of_utia(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"not a measurement")
    with pytest.raises(MeasurementError, match=rf"^{name}: .*"):
        readers.read(path)


def test_encoding_that_a_format_does_not_have(measured, cloth):
    with pytest.raises(MeasurementError, match=r"^copper\.binary: encoding linear, .* no choice"):
        readers.read(measured, encoding="linear")
    with pytest.raises(MeasurementError, match=r"encoding rec709, .* have linear, srgb-140"):
        readers.read(cloth, encoding="rec709")


def test_anisotropic_where_only_isotropic_ones_can_be_used(measured, cloth):
    assert readers.read_isotropic(measured).source.format == "merl"
    with pytest.raises(MeasurementError, match=r"^cloth\.dat: an anisotropic measurement"):
        readers.read_isotropic(cloth)
