# SPDX-License-Identifier: GPL-3.0-or-later
"""Every reader at what a folder of strangers may hold under the name of a measurement."""

import os
import signal

import pytest

from fitter.errors import NfmError, shown_name
from fitter.formats import parameter_file, readers
from tests import rights

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs the files of Unix")

READERS = {
    "gold.binary": readers.read,
    "gold.bin": readers.read,
    "gold.exr": readers.read,
    "gold.bsdf": readers.read,
    "gold.nfm.json": parameter_file.load,
}


def dangling(path):
    path.symlink_to(path.with_name("gone"))


def loop(path):
    other = path.with_name("other")
    other.symlink_to(path)
    path.symlink_to(other)


def folder(path):
    path.mkdir()


def link_to_a_folder(path):
    path.symlink_to(path.parent, target_is_directory=True)


def endless(path):
    path.symlink_to("/dev/zero")


def pipe(path):
    os.mkfifo(path)


def link_to_a_pipe(path):
    pipe(path.with_name("pipe"))
    path.symlink_to(path.with_name("pipe"))


def empty(path):
    path.touch()


@pytest.fixture
def patience():
    """A reader that waits for ever fails."""

    def stop(*_):
        raise TimeoutError

    old = signal.signal(signal.SIGALRM, stop)
    signal.alarm(20)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, old)


def refused(name, path):
    with pytest.raises(NfmError) as caught:
        READERS[name](path)
    message = str(caught.value)
    assert message.startswith(f"{shown_name(path)}: ")
    assert str(path.parent) not in message
    assert ";" in message
    return message


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "make",
    [dangling, loop, folder, link_to_a_folder, endless, pipe, link_to_a_pipe, empty],
    ids=lambda make: make.__name__,
)
def test_what_is_no_file_is_told(name, make, tmp_path, patience):
    make(tmp_path / name)
    before = sorted(tmp_path.iterdir())
    refused(name, tmp_path / name)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("name", READERS)
def test_what_may_not_be_read_is_told(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(b"secret")
    with rights.without(path, 0):
        assert "cannot be read" in refused(name, path)


@pytest.mark.parametrize("name", READERS)
def test_files_that_are_mostly_holes(name, tmp_path):
    """A terabyte that takes no place on the disk: refused by its size, not read."""
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(1 << 40)
    refused(name, path)
