import re
import string
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from osl import generate

TEMPLATES = sorted(Path(generate.__file__).parent.glob("*.osl.in"))

SIZES = {
    "isotropic": {
        "diffuse_albedo": 3,
        "scale": 9,
        "ndf": 270,
        "masking": 270,
        "fresnel": 270,
        "nodes": 92,
        "density": 276,
        "cumulative": 276,
        "selection": 279,
    },
    "anisotropic": {
        "diffuse_albedo": 3,
        "scale": 9,
        "ndf": 864,
        "masking": 864,
        "fresnel": 270,
        "nodes": 25,
        "density": 75,
        "cumulative": 75,
        "row_density": 3600,
        "row_cumulative": 3675,
        "selection": 3456,
    },
}
CASES = [(kind, name) for kind in SIZES for name in generate.SAMPLINGS]
TABLES = [(kind, table) for kind, sizes in SIZES.items() for table in sizes]

# One closure of each kind, in an order that is not that of generate.KINDS: 20 columns.
KINDS = ("phong_ramp", "ggx", "diffuse_ramp", "beckmann")
N_ANGLES, N_AZIMUTHS = 5, 2
N_VIEWS = N_ANGLES * N_AZIMUTHS
BASE_SIZES = {
    "parameters": 4,
    "across": 4,
    "leans": 4,
    "tilts": 4,
    "azimuths": 4,
    "angles": N_ANGLES,
    "weights": N_VIEWS * 3 * 20 * 3,
    "picking": N_VIEWS * 3 * 4,
}
BASE_ARRAYS = {
    "parameters": "closure_parameters",
    "across": "closure_across",
    "leans": "closure_leans",
    "tilts": "closure_tilts",
    "azimuths": "closure_azimuths",
    "angles": "base_angles",
    "weights": "base_weights",
    "picking": "base_picking",
}


def awkward_numbers(size, seed):
    """Single-precision numbers of all magnitudes, with every bit of the mantissa in use."""
    rng = np.random.default_rng(seed)
    values = (rng.uniform(1, 2, size) * 10 ** rng.uniform(-30, 12, size)).astype(np.float32)
    values[:3] = 0, 1, np.nextafter(np.float32(1), np.float32(2))
    return values


def numbers_of(kind):
    return {name: awkward_numbers(n, i) for i, (name, n) in enumerate(SIZES[kind].items())}


def tables_of(kind, numbers):
    """SurfaceTables of sequences by name."""
    inputs = {name: numbers[name] for name in ("diffuse_albedo", "scale")}
    rest = {name: values for name, values in numbers.items() if name not in inputs}
    return generate.SurfaceTables(kind=kind, tables=rest, **inputs)


def lists_of(kind):
    return {name: values.tolist() for name, values in numbers_of(kind).items()}


@pytest.fixture
def kind(request):
    return getattr(request, "param", "isotropic")


@pytest.fixture
def tables(kind):
    return tables_of(kind, lists_of(kind))


@pytest.fixture
def base_numbers():
    return {
        name: awkward_numbers(size, 50 + i) * (-1.0) ** np.arange(size)
        for i, (name, size) in enumerate(BASE_SIZES.items())
    }


@pytest.fixture
def base(base_numbers):
    return generate.BaseTables(
        kinds=KINDS,
        n_azimuths=N_AZIMUTHS,
        **{name: values.tolist() for name, values in base_numbers.items()},
    )


@pytest.fixture
def shader(tables, base):
    """Source for a sampling, with the base lobes where it has them."""

    def write(sampling, tables=tables, base=base):
        return generate.surface_shader(
            tables, sampling, base if sampling in generate.BASE_SAMPLINGS else None
        )

    return write


def array_of(source, name):
    """Declared length, numbers and colours of an array parameter's default."""
    found = re.search(rf"(int|float|color)\s+{name}\[(\d+)\] = \{{([^}}]*)\}}", source)
    values = [float(number) for number in re.findall(r"[-+.\de]+", found[3].replace("color", ""))]
    return found[1], int(found[2]), np.array(values, np.float32)


def test_the_sizes_are_those_of_the_tables():
    for kind, sizes in SIZES.items():
        assert {"diffuse_albedo": 3, "scale": 9} | generate.TABLES[kind] == sizes
    names = {field.name for field in fields(generate.BaseTables)}
    assert names == {"kinds", "n_azimuths", *BASE_SIZES}


@pytest.mark.parametrize(("kind", "sampling"), CASES, indirect=["kind"])
def test_all_placeholders_are_filled(shader, sampling):
    assert "$" not in shader(sampling)


@pytest.mark.parametrize(("kind", "sampling"), CASES, indirect=["kind"])
def test_numbers_come_through_to_the_last_bit(shader, kind, sampling):
    source, numbers = shader(sampling), numbers_of(kind)
    for table in numbers.keys() - {"diffuse_albedo"}:
        name = "scale" if table == "scale" else f"{table}_table"
        type_, declared, values = array_of(source, name)
        assert len(values) == declared * (3 if type_ == "color" else 1)
        np.testing.assert_array_equal(values, numbers[table], err_msg=name)
    diffuse = re.search(r"color\s+Diffuse = color\(([^)]*)\)", source)[1]
    np.testing.assert_array_equal(
        np.array(diffuse.split(","), float).astype(np.float32), numbers["diffuse_albedo"]
    )


@pytest.mark.parametrize("sampling", generate.BASE_SAMPLINGS)
def test_the_base_comes_through_to_the_last_bit(shader, base, base_numbers, sampling):
    source = shader(sampling)
    for table, name in BASE_ARRAYS.items():
        kind, declared, values = array_of(source, name)
        # arrays of colours of this size hang the compiler
        assert (kind, declared) == ("float", len(values))
        np.testing.assert_array_equal(values, base_numbers[table], err_msg=name)
    kind, declared, values = array_of(source, "closure_kinds")
    assert (kind, declared) == ("int", 4)
    assert [generate.KINDS[int(value)] for value in values] == list(KINDS)
    sizes = dict(re.findall(r"^#define (N_[A-Z_]+) (\d+)$", source, re.M))
    expected = {
        "N_CLOSURES": 4,
        "N_COLUMNS": 20,
        "N_VIEW_ROWS": N_ANGLES,
        "N_VIEW_AZIMUTHS": N_AZIMUTHS,
    }
    assert {name: int(sizes[name]) for name in expected} == expected
    assert f"float weight_table[{N_VIEWS * 9 * 20}]" in source
    assert f"float picking_table[{N_VIEWS * 3 * 4}]" in source


def test_kinds_have_the_numbers_that_the_shader_calls_them_by(shader):
    source = shader("native")
    for number, kind in enumerate(generate.KINDS):
        assert re.search(rf"^#define {kind.upper()} {number}$", source, re.M), kind


@pytest.mark.parametrize("sampling", generate.BASE_SAMPLINGS)
def test_base_samplings_need_a_base(tables, sampling):
    with pytest.raises(ValueError, match=f"^sampling '{sampling}' needs base lobes$"):
        generate.surface_shader(tables, sampling)


@pytest.mark.parametrize("table", BASE_SIZES.keys() - {"angles"})
@pytest.mark.parametrize("change", [-3, 3])
def test_wrong_size_of_the_base_is_refused(shader, base, table, change):
    size = BASE_SIZES[table]
    wrong = replace(base, **{table: [0.5] * (size + change)})
    message = rf"^{table}: {size + change} numbers, expected {size}$"
    with pytest.raises(ValueError, match=message):
        shader("native", base=wrong)


def test_base_of_other_angles_is_refused(shader, base):
    with pytest.raises(ValueError, match=r"^weights: 1800 numbers, expected 1440$"):
        shader("exact", base=replace(base, angles=base.angles[:-1]))
    with pytest.raises(ValueError, match=r"^weights: 1800 numbers, expected 900$"):
        shader("exact", base=replace(base, n_azimuths=1))


@pytest.mark.parametrize("table", BASE_SIZES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_base_that_is_not_finite_is_refused(shader, base, table, value):
    values = list(getattr(base, table))
    values[-1] = float(value)
    with pytest.raises(ValueError, match="cannot be written into a shader"):
        shader("smooth", base=replace(base, **{table: values}))


@pytest.mark.parametrize("table", BASE_SIZES)
@pytest.mark.parametrize("text", ["0); evil(", "1", "$ndf"])
def test_text_does_not_enter_by_the_base(shader, base, table, text):
    values = list(getattr(base, table))
    values[0] = text
    with pytest.raises(TypeError):
        shader("native", base=replace(base, **{table: values}))


@pytest.mark.parametrize("closure", ["GGX", "0", "", "evil("])
def test_unknown_kind_of_closure_is_refused(shader, base, closure):
    with pytest.raises((KeyError, ValueError)):
        shader("native", base=replace(base, kinds=(closure, *KINDS[1:])))


def base_of(kinds):
    """A base of zeros over two angles."""
    n_columns = sum(generate.COLUMNS[kind] for kind in kinds)
    zeros = [0.0] * len(kinds)
    return generate.BaseTables(
        kinds=kinds,
        **dict.fromkeys(generate.PER_CLOSURE, zeros),
        angles=[0.0, 1.0],
        n_azimuths=1,
        weights=[0.0] * (2 * 9 * n_columns),
        picking=[0.0] * (6 * len(kinds)),
    )


def test_slots():
    assert base_of(KINDS).slots == 1 + 3 + 2 + 3 + 2
    assert base_of([]).slots == 1


@pytest.mark.parametrize("sampling", ["smooth", "exact"])
@pytest.mark.parametrize(
    ("ramps", "lobes", "candidates"),
    [(0, 0, 21), (1, 0, 20), (0, 10, 14), (0, 29, 1), (20, 0, 1), (1, 28, 1)],
)
def test_candidates_take_the_room_that_the_base_leaves(shader, sampling, ramps, lobes, candidates):
    base = base_of(["phong_ramp"] * ramps + ["ggx"] * lobes)
    assert f"clamp(Candidates, 1, {candidates})" in shader(sampling, base=base)
    taken = base.slots + generate.SLOTS["phong_ramp"] * candidates
    assert taken <= generate.CLOSURE_SLOTS < taken + generate.SLOTS["phong_ramp"]


@pytest.mark.parametrize("sampling", ["smooth", "exact"])
@pytest.mark.parametrize(("closure", "count", "slots"), [("phong_ramp", 21, 64), ("ggx", 31, 63)])
def test_base_without_room_for_a_candidate_is_refused(shader, sampling, closure, count, slots):
    with pytest.raises(ValueError, match=f"^{count} closures take {slots} of 64 places$"):
        shader(sampling, base=base_of([closure] * count))


def test_floats_are_written_as_floats(shader, monkeypatch):
    """A whole number would make OSL divide as integers, or refuse an argument."""
    monkeypatch.setitem(generate.KERNELS_PER_DIRECTION, "exact", 1000)
    monkeypatch.setitem(generate.RESIDUAL_BOOST, "exact", 2.5)
    source = shader("exact")
    assert "#define KERNELS_PER_DIRECTION 1000.0\n" in source
    assert "#define RESIDUAL_BOOST 2.5\n" in source


@pytest.mark.parametrize(("kind", "table"), TABLES, indirect=["kind"])
@pytest.mark.parametrize("change", [-1, 1])
def test_wrong_size_is_refused(kind, table, change):
    size = SIZES[kind][table]
    wrong = tables_of(kind, lists_of(kind) | {table: [0.5] * (size + change)})
    with pytest.raises(ValueError, match=rf"^{table}: {size + change} numbers, expected {size}$"):
        generate.surface_shader(wrong)


@pytest.mark.parametrize(("kind", "table"), TABLES, indirect=["kind"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite_is_refused(kind, table, value):
    numbers = lists_of(kind)
    numbers[table][-1] = float(value)
    with pytest.raises(ValueError, match="cannot be written into a shader"):
        generate.surface_shader(tables_of(kind, numbers))


@pytest.mark.parametrize(
    ("kind", "sampling"),
    [(kind, name) for kind in SIZES for name in ("base", "REFERENCE", "", "../lookup")],
    indirect=["kind"],
)
def test_unknown_sampling_is_refused(tables, sampling):
    names = ", ".join(generate.SAMPLINGS)
    with pytest.raises(ValueError, match=f"^sampling '{sampling}', expected one of {names}$"):
        generate.surface_shader(tables, sampling)


@pytest.mark.parametrize(("kind", "table"), TABLES, indirect=["kind"])
@pytest.mark.parametrize("text", ["0); evil(", "1", "nan", "$ndf", ""])
def test_text_does_not_enter(kind, table, text):
    numbers = lists_of(kind)
    numbers[table][0] = text
    with pytest.raises(TypeError):
        generate.surface_shader(tables_of(kind, numbers))


@pytest.mark.parametrize(("kind", "sampling"), CASES, indirect=["kind"])
def test_only_numbers_distinguish_two_shaders(shader, kind, base, sampling):
    ones = tables_of(kind, {name: [1.0] * size for name, size in SIZES[kind].items()})
    ones_base = replace(base, **{name: [1.0] * size for name, size in BASE_SIZES.items()})
    number = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(e[-+]?\d+)?(?![\w.])")
    shapes = [
        number.sub("#", source)
        for source in (shader(sampling), shader(sampling, tables=ones, base=ones_base))
    ]
    assert shapes[0] == shapes[1]


@pytest.mark.parametrize("sampling", ["reference", "exact"])
def test_same_tables_give_the_same_text(shader, kind, base, base_numbers, sampling):
    again = tables_of(kind, {name: tuple(v) for name, v in lists_of(kind).items()})
    again_base = replace(base, **{name: tuple(v.tolist()) for name, v in base_numbers.items()})
    assert shader(sampling) == shader(sampling, tables=again, base=again_base)


def test_samplings_differ_in_their_directions_only(shader):
    reference, cosine = shader("reference"), shader("cosine")
    assert "      sample_half_vector(u" in reference
    assert "      sample_half_vector(u" not in cosine
    assert array_of(reference, "ndf_table")[2].tolist() == array_of(cosine, "ndf_table")[2].tolist()


@pytest.mark.parametrize(
    ("sampling", "candidates"),
    [("native", 0), ("smooth", 2), ("exact", 2), ("reference", 4), ("cosine", 1)],
)
def test_candidates_by_default(shader, sampling, candidates):
    assert re.search(r"Candidates = (\d+)", shader(sampling))[1] == str(candidates)


def test_native_is_the_base_and_nothing_random(shader):
    native, exact = shader("native"), shader("exact")
    assert "= base_lobes(n, tangent, bitangent, side, theta_o," in native
    for drawn in ("= uniform_numbers(", "= base_value(", "= residual_lobe("):
        assert drawn not in native
        assert drawn in exact


def test_smooth_and_exact_differ_in_their_kernels_only(shader):
    lines = [shader(sampling).splitlines() for sampling in ("smooth", "exact")]
    changed = [pair for pair in zip(*lines, strict=True) if pair[0] != pair[1]]
    assert [[line.rsplit(" ", 1)[0] for line in pair] for pair in changed] == [
        ["#define KERNELS_PER_DIRECTION"] * 2,
        ["#define RESIDUAL_BOOST"] * 2,
    ]


@pytest.mark.parametrize("sampling", ["reference", "cosine"])
def test_samplings_of_mirrors_take_no_base(shader, tables, base, sampling):
    assert generate.surface_shader(tables, sampling, base) == shader(sampling)


@pytest.mark.parametrize(("kind", "sampling"), CASES, indirect=["kind"])
def test_source_opens_with_its_licence_and_is_plain_ascii(shader, sampling):
    source = shader(sampling)
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


def test_every_template_is_used(shader):
    """Each template but the shader itself is reached, its text unchanged but for numbers."""
    sources = [shader(sampling, tables=tables_of(kind, lists_of(kind))) for kind, sampling in CASES]
    assert len(TEMPLATES) == 18
    for template in TEMPLATES:
        if template.name == "nfm_surface.osl.in":
            continue
        # numbers are the only thing that is filled in
        text = re.escape(template.read_text(encoding="utf-8").rstrip())
        pattern = re.compile(re.sub(r"\\\$\w+", "[-+.e0-9]+", text))
        assert any(pattern.search(source) for source in sources), template.name


def test_missing_key_is_an_error(tables, monkeypatch):
    broken = string.Template("$lookup $nobody_knows_this")
    monkeypatch.setattr(generate, "_template", lambda _name: broken)
    with pytest.raises(KeyError, match="nobody_knows_this"):
        generate.surface_shader(tables)
