# SPDX-License-Identifier: GPL-3.0-or-later
"""What the import dialog says about a file."""

from types import SimpleNamespace

import pytest

from fitter import synthetic
from fitter.formats import utia


@pytest.fixture
def formats(addon):
    return addon("formats")


def test_the_content_decides(formats, parameter_path, tmp_path):
    merl = tmp_path / "measured.exr"
    synthetic.write_sample(merl, "velvet")
    assert formats.name_of(str(merl)) == "MERL"
    assert not formats.has_encodings(str(merl))
    assert formats.name_of(str(parameter_path)) == "NFM"
    assert not formats.has_encodings(str(parameter_path))


def test_utia_files_have_a_choice(formats, tmp_path):
    path = tmp_path / "wood.bin"
    path.write_bytes(bytes(8))
    assert formats.name_of(str(path)) == "UTIA-BIN"
    assert formats.has_encodings(str(path))
    assert len(utia.ENCODINGS) == 2


def test_a_folder_or_nothing_has_no_format(formats, tmp_path):
    for path in (tmp_path, tmp_path / "none.bin", ""):
        assert formats.name_of(str(path)) == ""
        assert formats.has_encodings(str(path))


def test_the_file_that_is_chosen_in_a_browser(formats):
    params = SimpleNamespace(
        directory="/measured/gr\N{LATIN SMALL LETTER U WITH DIAERESIS}n".encode()
    )
    params.filename = "wood.bin"
    space = SimpleNamespace(type="FILE_BROWSER", params=params)
    path = formats.chosen(SimpleNamespace(space_data=space))
    assert path == "/measured/gr\N{LATIN SMALL LETTER U WITH DIAERESIS}n/wood.bin"
    assert formats.chosen(SimpleNamespace(space_data=None)) == ""
    assert formats.chosen(SimpleNamespace(space_data=SimpleNamespace(type="VIEW_3D"))) == ""
