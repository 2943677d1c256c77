# SPDX-License-Identifier: GPL-3.0-or-later
import json
from pathlib import Path

import numpy as np
import pytest

from fitter.errors import ParameterFileError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial, dumps, load, loads, save
from fitter.measurement import Source
from tests.models import random_anisotropic

FACTORS = ("diffuse", "scale", "ndf", "masking", "fresnel")


@pytest.fixture(params=["isotropic", "anisotropic"])
def material(request, random_model):
    return FittedMaterial(
        name="gold \u00e9\u4e2d",
        model={"isotropic": random_model, "anisotropic": random_anisotropic}[request.param](0),
        source=Source("gold.binary", "merl", "ab" * 32),
        fit={"objective": 1.25e-3, "iterations": 97, "weight": "display-gamma"},
    )


@pytest.fixture
def document(material):
    return json.loads(dumps(material))


def refused(text, name="gold.nfm.json"):
    with pytest.raises(ParameterFileError) as caught:
        loads(text, name)
    message = str(caught.value)
    assert message.startswith(f"{name}: ")
    assert message.isprintable()
    assert len(message) < 400
    return message


def test_round_trip_keeps_every_bit(material):
    again = loads(dumps(material))
    for name in FACTORS:
        before, after = getattr(material.model, name), getattr(again.model, name)
        assert after.dtype == np.float64
        assert before.tobytes() == after.tobytes()
    assert (again.name, again.source, again.fit) == (material.name, material.source, material.fit)


def test_round_trip_of_extreme_numbers(material):
    diffuse = np.array([5e-324, 1e12, 0.1 + 0.2])
    model = type(material.model)(diffuse, *(getattr(material.model, n) for n in FACTORS[1:]))
    again = loads(dumps(FittedMaterial("x", model)))
    assert again.model.diffuse.tobytes() == diffuse.tobytes()
    assert again.source is None
    assert again.fit == {}


def test_same_material_gives_the_same_text(material):
    text = dumps(material)
    assert dumps(loads(text)) == text
    assert text.isascii()
    assert text.endswith("}\n")


def test_fields_of_both_kinds(document):
    assert document["format"] == "nfm"
    assert document["version"] == 1
    assert document["model"] == "shared3"
    table = {"isotropic": (3, 90), "anisotropic": (3, 6, 48)}[document["kind"]]
    shapes = {key: np.shape(document[key]) for key in ("diffuse", "scale", "D", "G", "F")}
    assert shapes == {"diffuse": (3,), "scale": (3, 3), "D": table, "G": table, "F": (3, 90)}
    assert document["grids"]["theta_d"][1] == pytest.approx(np.radians(1.5), rel=1e-15)


def test_grids(random_model):
    isotropic, anisotropic = (
        json.loads(dumps(FittedMaterial("x", model)))["grids"]
        for model in (random_model(0), random_anisotropic(0))
    )
    assert isotropic["theta_h"][0] == pytest.approx((0.5 / 90) ** 2 * np.pi / 2, rel=1e-15)
    assert isotropic["theta"][1] == pytest.approx(np.pi / 2 / 89, rel=1e-15)
    assert anisotropic.keys() == {"theta", "phi", "theta_d"}
    np.testing.assert_allclose(anisotropic["theta"], np.radians([0, 15, 30, 45, 60, 75]))
    np.testing.assert_allclose(anisotropic["phi"], np.radians(7.5) * np.arange(48))


def test_material_that_could_not_be_read_back_is_not_written(material, tmp_path):
    scale = material.model.scale.copy()
    scale[0, 0] = np.nan
    model = type(material.model)(
        material.model.diffuse, scale, *list(vars(material.model).values())[2:]
    )
    with pytest.raises(ParameterFileError, match=r"^x\.nfm\.json: "):
        save(tmp_path / "x.nfm.json", FittedMaterial("x", model))
    assert list(tmp_path.iterdir()) == []


# --- malformed files ---


def test_truncated_anywhere(material):
    text = dumps(material)
    end = len(text.rstrip())
    for length in [*range(0, 200), *range(200, end, 997), *range(end - 50, end)]:
        refused(text[:length])


@pytest.mark.parametrize("key", ["diffuse", "scale", "D", "G", "F"])
@pytest.mark.parametrize(
    "number",
    [
        "NaN", "Infinity", "-Infinity", "1e999", "-1e999", "-1", "-1e-30", "1.1e12", "true", '"1"',
        "null", "[]", "{}", "1" + "0" * 400, "-1" + "0" * 400, "9" * 5000, "[1]",
    ],
)  # fmt: skip
def test_bad_number(document, key, number):
    row = document[key] if key == "diffuse" else document[key][2]
    if isinstance(row[1], list):
        row = row[1]
    row[1] = "HERE"
    refused(json.dumps(document).replace('"HERE"', number))


@pytest.mark.parametrize("key", ["diffuse", "scale", "D", "G", "F"])
def test_wrong_shape(document, key):
    good = document[key]
    flat = np.array(good).ravel().tolist()
    for bad in (good[:-1], [*good, good[0]], [good], flat * 2, [], {}, None, 1, "x", [[]] * 3):
        document[key] = bad
        assert f'"{key}"' in refused(json.dumps(document))
    del document[key]
    assert f'"{key}"' in refused(json.dumps(document))


@pytest.mark.parametrize("key", ["format", "version", "model", "kind", "interpolation"])
@pytest.mark.parametrize("value", [None, 2, True, [], {}, "x" * 5000, "\ud800", {"D": "linear"}])
def test_wrong_header(document, key, value):
    document[key] = value
    refused(json.dumps(document))
    del document[key]
    refused(json.dumps(document))


def test_wrong_grid(document):
    for key, good in document["grids"].items():
        for bad in ([x + 1e-3 for x in good], good[::-1], good[1:], None, "x"):
            document["grids"][key] = bad
            assert key in refused(json.dumps(document))
        document["grids"][key] = good
    for bad in (None, [], 1, {}):
        document["grids"] = bad
        refused(json.dumps(document))


def test_one_kind_is_not_taken_for_the_other(document):
    document["kind"] = {"isotropic": "anisotropic", "anisotropic": "isotropic"}[document["kind"]]
    refused(json.dumps(document))


@pytest.mark.parametrize("key", ["D", "G"])
def test_pole_that_is_not_one_number(key):
    document = json.loads(dumps(FittedMaterial("x", random_anisotropic(0))))
    document[key][1][0][17] *= 1.001
    assert "theta = 0" in refused(json.dumps(document))


@pytest.mark.parametrize("value", [None, 1, [], {}, "x" * 1025, "\ud800", "a\udfffb"])
def test_wrong_name(document, value):
    document["name"] = value
    assert '"name"' in refused(json.dumps(document))


@pytest.mark.parametrize(
    "value", [1, [], {}, "x", {"file": "a", "format": "merl"}, {"file": 1}, {"file": "\ud800"}]
)
def test_wrong_source(document, value):
    document["source"] = value
    refused(json.dumps(document))


@pytest.mark.parametrize(
    "value",
    [
        None, 1, [], "x", {"a": None}, {"a": []}, {"a": True}, {"a": 1e13}, {"a": "x" * 1025},
        {"a": "\ud800"}, {"a\nb" * 900: "x" * 1025}, {"\ud800": []}, {"\ud800": 1}, {"\n": 1},
        {str(n): n for n in range(101)},
    ],
)  # fmt: skip
def test_wrong_figures(document, value):
    document["fit"] = value
    refused(json.dumps(document))


@pytest.mark.parametrize("text", ["", " ", "[]", "1", '"nfm"', "null", "{}", "{'a': 1}", "\x00"])
def test_other_json(text):
    refused(text)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, "[" * 100_000 + "]" * 100_000])
def test_deeply_nested(text):
    refused(text)


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_deeply_nested_figure(document, opening):
    document["fit"] = "HERE"
    closing = "]" if opening == "[" else "}"
    nested = opening * 100_000 + "1" + closing * 100_000
    refused(json.dumps(document).replace('"HERE"', nested))


def test_reads_files_by_any_path_type(material, tmp_path):
    path = tmp_path / "gold.nfm.json"
    save(path, material)
    assert path.read_bytes() == dumps(material).encode()
    assert load(path).name == load(str(path)).name == material.name


@pytest.mark.parametrize(
    "content",
    [
        b"\xff\xfe\x00",
        b'{"name": "\xe9"}',
        b"\xed\xa0\x80",
        b"",
        b"\x00" * 100,
        b" " * (4 << 20) + b"{}",
    ],
)
def test_unreadable_content(tmp_path, content):
    path = tmp_path / "gold.nfm.json"
    path.write_bytes(content)
    with pytest.raises(ParameterFileError, match=r"^gold\.nfm\.json: "):
        load(path)


def test_too_large(material, tmp_path):
    path = tmp_path / "gold.nfm.json"
    path.write_text(dumps(material) + " " * parameter_file.MAX_FILE_SIZE)
    with pytest.raises(ParameterFileError, match=r"^gold\.nfm\.json: [\d,]+ bytes"):
        load(path)


def test_not_a_file(tmp_path):
    for path in (tmp_path, tmp_path / "missing.nfm.json", tmp_path / "a" / "b.json", "a\0b"):
        with pytest.raises(ParameterFileError) as caught:
            load(path)
        assert Path(str(path)).name.replace("\0", "\\x00") in str(caught.value)


def test_file_name_with_a_newline(tmp_path):
    path = tmp_path / "evil\nname\x1b[31m.nfm.json"
    with pytest.raises(ParameterFileError) as caught:
        load(path)
    assert str(caught.value).isprintable()
    path.write_bytes(b"{")
    with pytest.raises(ParameterFileError) as caught:
        load(path)
    assert str(caught.value).startswith(r"evil\nname\x1b[31m.nfm.json: ")


# --- saving ---


def test_save_replaces(material, tmp_path, random_model):
    path = tmp_path / "gold.nfm.json"
    path.write_text("something else")
    save(path, material)
    assert load(path).name == material.name
    assert list(tmp_path.iterdir()) == [path]


def test_save_over_a_folder(material, tmp_path):
    target = tmp_path / "gold.nfm.json"
    target.mkdir()
    (target / "kept").write_text("x")
    with pytest.raises(ParameterFileError, match=r"^gold\.nfm\.json: cannot be written"):
        save(target, material)
    assert list(tmp_path.iterdir()) == [target]
    assert (target / "kept").read_text() == "x"


@pytest.mark.parametrize("path", ["missing/gold.nfm.json", "go\0ld.nfm.json"])
def test_save_to_nowhere(material, tmp_path, path):
    with pytest.raises(ParameterFileError, match="cannot be written"):
        save(f"{tmp_path}/{path}", material)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("when", ["write", "replace"])
def test_failed_save_leaves_the_old_file(material, tmp_path, monkeypatch, error, when):
    path = tmp_path / "gold.nfm.json"
    path.write_text("old")

    def fail(*arguments):
        raise error

    class Full:
        def __init__(self, file):
            self.file = file

        def __enter__(self):
            return self

        def __exit__(self, *exception):
            self.file.close()

        def write(self, chunk):
            self.file.write(chunk[: len(chunk) // 2])
            raise error

    if when == "replace":
        monkeypatch.setattr(Path, "replace", fail)
    else:
        opened = Path.open
        monkeypatch.setattr(Path, "open", lambda self, *a, **k: Full(opened(self, *a, **k)))
    expected = ParameterFileError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(expected):
        save(path, material)
    monkeypatch.undo()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_limits_leave_room_for_honest_files(material):
    assert len(dumps(material)) < parameter_file.MAX_FILE_SIZE / 50


# --- files of the past ---


VERSION_1 = Path(__file__).parent / "version_1"


@pytest.mark.parametrize("name", ["isotropic", "anisotropic", "preset"])
def test_files_of_version_1_can_always_be_read(name):
    """Written when the format was new, and never again: a change that breaks this breaks users."""
    material = load(VERSION_1 / f"{name}.nfm.json")
    kind = "anisotropic" if name == "anisotropic" else "isotropic"
    assert material.name == f"{kind} gold"
    assert material.source == Source("gold.binary", "merl", "ab" * 32)
    assert material.fit["studio_psnr"] == 48.5
    assert material.model.kind == kind
    wi, wo = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.36, 0.48, 0.8]])
    expected = {
        "isotropic": [0.0195491, 0.0354591, 0.0991191],
        "anisotropic": [0.0758342, 0.1098648, 0.1808324],
    }
    np.testing.assert_allclose(material.model.f_r(wi, wo)[0], expected[kind], rtol=1e-5)
    if name == "preset":
        assert material.edits.sliders.lobes[0].width == 1.5
        assert material.edits.sliders.specular_saturation == 0.5
        changed = [
            curve
            for curve, handles in material.edits.curves.items()
            if handles != material.edits.drawn[curve]
        ]
        assert changed == ["Lobe 2 D"]
