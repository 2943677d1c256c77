# SPDX-License-Identifier: GPL-3.0-or-later
import json
from dataclasses import replace

import pytest

from fitter.editing import edit_document
from fitter.editing.edit_document import BlendDocument, EditDocument
from fitter.editing.edits import LobeSliders, Sliders
from fitter.errors import ParameterFileError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS

HANDLES = ((0.0, 1.0, "AUTO_CLAMPED"), (0.3, 0.25, "VECTOR"), (1.0, 0.0, "AUTO"))
EDITS = EditDocument(
    curves={"Lobe 1 D": HANDLES, "F Red": HANDLES[::2]},
    drawn={"Lobe 1 D": HANDLES[::2], "F Red": HANDLES},
    sliders=Sliders(
        lobes=(LobeSliders(width=2.0), LobeSliders(gain=0.5), LobeSliders()), edge_strength=1.5
    ),
)


def parsed(document):
    return edit_document.from_json(json.loads(json.dumps(document)), "x.nfm.json")


def test_round_trip():
    assert parsed(edit_document.to_json(EDITS)) == EDITS


def test_all_is_neutral_that_is_not_given():
    assert parsed({}) == EditDocument()
    assert parsed({"sliders": {"edge_strength": 2}}) == EditDocument(
        sliders=Sliders(edge_strength=2.0)
    )
    lobes = [{}, {"haze": 0.5}, {}]
    assert parsed({"sliders": {"lobes": lobes}}).sliders.lobes[1] == LobeSliders(haze=0.5)


def test_presets_keep_tables_and_edits_apart():
    plain = FittedMaterial("plastic", MODELS["plastic"])
    text = parameter_file.dumps(replace(plain, edits=EDITS))
    loaded = parameter_file.loads(text)
    assert loaded.edits == EDITS
    assert parameter_file.dumps(replace(loaded, edits=None)) == parameter_file.dumps(plain)
    # a reader of version 1 that does not know edits finds everything it knows
    document = json.loads(text)
    del document["edits"]
    assert parameter_file.loads(json.dumps(document)).edits is None
    assert document == json.loads(parameter_file.dumps(plain))


def test_the_material_to_blend_with_goes_along():
    other = parameter_file.dumps(FittedMaterial("metal", MODELS["metal"]))
    edits = EditDocument(blend=BlendDocument("metal", 0.25, other))
    text = parameter_file.dumps(FittedMaterial("plastic", MODELS["plastic"], edits=edits))
    assert parameter_file.loads(text).edits == edits


def test_the_material_to_blend_with_is_checked():
    other = parameter_file.dumps(FittedMaterial("metal", MODELS["metal"]))
    edits = EditDocument(blend=BlendDocument("metal", 0.5, other))
    text = parameter_file.dumps(FittedMaterial("plastic", MODELS["plastic"], edits=edits))
    document = json.loads(text)
    model = document["edits"]["blend"]["model"]
    brushed = FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"])
    for wrong, message in (
        ({**model, "D": [[1]]}, r'^"blend" of parameters: "D"'),
        ({**model, "edits": {}}, "has edits of its own"),
        (json.loads(parameter_file.dumps(brushed)), "is isotropic and that of"),
        ("metal", 'no "name" and "model"'),
    ):
        document["edits"]["blend"]["model"] = wrong
        with pytest.raises(ParameterFileError, match=message):
            parameter_file.loads(json.dumps(document))


BAD = {
    "list": [],
    "unknown part": {"shader": "x"},
    "blend with nothing": {"blend": {"share": 0.5}},
    "blend too far": {"blend": {"share": 2, "name": "x", "model": {}}},
    "unknown curve": {"curves": {"Lobe 9 D": []}},
    "one handle": {"curves": {"F": [[0, 0, "AUTO"]]}},
    "many handles": {"curves": {"F": [[0, 0, "AUTO"]] * 1000}},
    "odd handle": {"curves": {"F": [[0, 0], [1, 1]]}},
    "odd kind": {"curves": {"F": [[0, 0, "AUTO"], [1, 1, "rm -rf"]]}},
    "list as kind": {"curves": {"F": [[0, 0, "AUTO"], [1, 1, []]]}},
    "far handle": {"curves": {"F": [[0, 0, "AUTO"], [1e9, 1, "AUTO"]]}},
    "huge handle": {"curves": {"F": [[0, 0, "AUTO"], [10**400, 1, "AUTO"]]}},
    "text as number": {"curves": {"F": [[0, 0, "AUTO"], ["1", 1, "AUTO"]]}},
    "not drawn": {"curves": {"F": [[0, 0, "AUTO"], [1, 1, "AUTO"]]}},
    "unknown slider": {"sliders": {"import os": 1}},
    "true": {"sliders": {"edge_strength": True}},
    "out of range": {"sliders": {"edge_strength": -1}},
    "two lobes": {"sliders": {"lobes": [{}, {}]}},
    "odd lobe": {"sliders": {"lobes": [{}, {}, {"size": 1}]}},
    "wide lobe": {"sliders": {"lobes": [{}, {}, {"width": 1e6}]}},
    "grey tint": {"sliders": {"edge_tint": 1}},
    "hot tint": {"sliders": {"edge_tint": [1, 1, 2]}},
}


@pytest.mark.parametrize("document", BAD.values(), ids=BAD)
def test_bad_edits_are_refused(document):
    with pytest.raises(ParameterFileError, match=r"^x\.nfm\.json: .*; save the preset again$"):
        parsed(document)


@pytest.mark.parametrize("text", ["NaN", "Infinity", "1e999"])
def test_numbers_that_are_none_are_refused(text):
    document = parameter_file.dumps(replace(FittedMaterial("p", MODELS["plastic"]), edits=EDITS))
    with pytest.raises(ParameterFileError):
        parameter_file.loads(document.replace('"edge_strength": 1.5', f'"edge_strength": {text}'))
