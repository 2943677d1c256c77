import re
import string
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from osl import generate

TEMPLATES = sorted(Path(generate.__file__).parent.glob("*.osl.in"))

SIZES = {
    "diffuse_albedo": 3,
    "scale": 9,
    "ndf": 270,
    "masking": 270,
    "fresnel": 270,
    "nodes": 92,
    "density": 276,
    "cumulative": 276,
    "selection": 279,
}

# Name in the shader of each table.
ARRAYS = {
    "scale": "scale",
    "ndf": "ndf_table",
    "masking": "masking_table",
    "fresnel": "fresnel_table",
    "nodes": "nodes_table",
    "density": "density_table",
    "cumulative": "cumulative_table",
    "selection": "selection_table",
}


def awkward_numbers(size, seed):
    """Single-precision numbers of all magnitudes, with every bit of the mantissa in use."""
    rng = np.random.default_rng(seed)
    values = (rng.uniform(1, 2, size) * 10 ** rng.uniform(-30, 12, size)).astype(np.float32)
    values[:3] = 0, 1, np.nextafter(np.float32(1), np.float32(2))
    return values


@pytest.fixture
def numbers():
    return {name: awkward_numbers(size, i) for i, (name, size) in enumerate(SIZES.items())}


@pytest.fixture
def tables(numbers):
    return generate.SurfaceTables(**{name: values.tolist() for name, values in numbers.items()})


def array_of(source, name):
    """Declared length, numbers and colours of an array parameter's default."""
    found = re.search(rf"(float|color)\s+{name}\[(\d+)\] = \{{([^}}]*)\}}", source)
    values = [float(number) for number in re.findall(r"[-+.\de]+", found[3].replace("color", ""))]
    return found[1], int(found[2]), np.array(values, np.float32)


def test_the_sizes_are_those_of_the_tables():
    assert [field.name for field in fields(generate.SurfaceTables)] == list(SIZES)


@pytest.mark.parametrize("sampling", generate.SAMPLINGS)
def test_all_placeholders_are_filled(tables, sampling):
    assert "$" not in generate.surface_shader(tables, sampling)


@pytest.mark.parametrize("sampling", generate.SAMPLINGS)
def test_numbers_come_through_to_the_last_bit(tables, numbers, sampling):
    source = generate.surface_shader(tables, sampling)
    for table, name in ARRAYS.items():
        kind, declared, values = array_of(source, name)
        assert len(values) == declared * (3 if kind == "color" else 1)
        np.testing.assert_array_equal(values, numbers[table], err_msg=name)
    diffuse = re.search(r"color\s+Diffuse = color\(([^)]*)\)", source)[1]
    np.testing.assert_array_equal(
        np.array(diffuse.split(","), float).astype(np.float32), numbers["diffuse_albedo"]
    )


@pytest.mark.parametrize("table", SIZES)
@pytest.mark.parametrize("change", [-1, 1])
def test_wrong_size_is_refused(tables, table, change):
    size = SIZES[table]
    with pytest.raises(ValueError, match=rf"^{table}: {size + change} numbers, expected {size}$"):
        generate.surface_shader(replace(tables, **{table: [0.5] * (size + change)}))


@pytest.mark.parametrize("table", SIZES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite_is_refused(tables, table, value):
    values = list(getattr(tables, table))
    values[-1] = float(value)
    with pytest.raises(ValueError, match="cannot be written into a shader"):
        generate.surface_shader(replace(tables, **{table: values}))


@pytest.mark.parametrize("sampling", ["native", "REFERENCE", "", "../lookup"])
def test_unknown_sampling_is_refused(tables, sampling):
    with pytest.raises(ValueError, match="expected one of reference, cosine"):
        generate.surface_shader(tables, sampling)


@pytest.mark.parametrize("table", SIZES)
@pytest.mark.parametrize("text", ["0); evil(", "1", "nan", "$ndf", ""])
def test_text_does_not_enter(tables, table, text):
    values = list(getattr(tables, table))
    values[0] = text
    with pytest.raises(TypeError):
        generate.surface_shader(replace(tables, **{table: values}))


def test_only_numbers_distinguish_two_shaders(tables):
    ones = generate.SurfaceTables(**{name: [1.0] * size for name, size in SIZES.items()})
    number = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[-+]?\d+)?(?![\w.])")
    shapes = [number.sub("#", generate.surface_shader(t)) for t in (tables, ones)]
    assert shapes[0] == shapes[1]


def test_same_tables_give_the_same_text(tables, numbers):
    again = generate.SurfaceTables(**{name: tuple(v.tolist()) for name, v in numbers.items()})
    assert generate.surface_shader(tables) == generate.surface_shader(again)


def test_samplings_differ_in_their_directions_only(tables):
    reference, cosine = (generate.surface_shader(tables, s) for s in ("reference", "cosine"))
    assert "sample_versine(min(" in reference
    assert "sample_versine(min(" not in cosine
    assert re.search(r"Candidates = (\d+)", reference)[1] == "4"
    assert re.search(r"Candidates = (\d+)", cosine)[1] == "1"
    assert array_of(reference, "ndf_table")[2].tolist() == array_of(cosine, "ndf_table")[2].tolist()


@pytest.mark.parametrize("sampling", generate.SAMPLINGS)
def test_source_opens_with_its_licence_and_is_plain_ascii(tables, sampling):
    source = generate.surface_shader(tables, sampling)
    assert source.startswith("/* SPDX-License-Identifier: GPL-3.0-or-later\n")
    assert source.isascii()
    assert source.count("shader nfm_surface(") == 1


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda path: path.name)
def test_template_is_tidy(template):
    text = template.read_text(encoding="utf-8")
    assert "\t" not in text
    assert text.endswith("\n")
    too_long = [line for line in text.splitlines() if len(line) > 99 or line != line.rstrip()]
    assert too_long == []


def test_every_template_is_used(tables):
    """A placeholder stands in the shader alone, and each of the other templates reaches it."""
    sources = [generate.surface_shader(tables, sampling) for sampling in generate.SAMPLINGS]
    assert len(TEMPLATES) == 5
    for template in TEMPLATES:
        text = template.read_text(encoding="utf-8")
        if template.name == "nfm_surface.osl.in":
            continue
        assert "$" not in text
        assert any(text.rstrip() in source for source in sources), template.name


def test_missing_key_is_an_error(tables, monkeypatch):
    broken = string.Template("$lookup $nobody_knows_this")
    monkeypatch.setattr(generate, "_template", lambda _name: broken)
    with pytest.raises(KeyError, match="nobody_knows_this"):
        generate.surface_shader(tables)
