# SPDX-License-Identifier: GPL-3.0-or-later
"""Word of changed properties."""

import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import MODELS


@pytest.fixture
def changes(addon):
    return addon("changes")


def test_listeners_hear_until_they_are_forgotten(changes):
    heard = []
    change = changes.Change()
    change.tell("nobody")
    change.listen(heard.append)
    change.tell("one")
    change.forget(heard.append)
    change.tell("two")
    assert heard == ["one"]


def test_what_a_listener_cannot_do_is_printed_and_the_next_one_hears(changes, addon, capsys):
    def fail(_material):
        raise addon("errors").ShaderError("material 'x' has no node any more")

    heard = []
    change = changes.Change()
    change.listen(fail)
    change.listen(heard.append)
    change.tell("one")
    assert heard == ["one"]
    assert capsys.readouterr().out == "nfm: material 'x' has no node any more\n"


def test_properties_tell(changes, addon, monkeypatch):
    material = addon("material").build(FittedMaterial("paint", MODELS["paint"]), "REFERENCE")
    settings = material.nfm

    def heard(kind, change):
        told = []
        monkeypatch.setattr(kind, "_listeners", [told.append])
        change()
        return told

    assert heard(changes.edits, lambda: setattr(settings.edit.lobe_2, "haze", 0.5)) == [material]
    assert heard(changes.edits, lambda: setattr(settings.edit, "blend", 0.5)) == [material]
    assert heard(changes.sampling, lambda: setattr(settings, "sampling", "COSINE")) == [material]
    assert heard(changes.audible, lambda: setattr(settings, "mute", (True, False, False)))
