# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that a script can call or read is in docs/API.md, and says what it does."""

import ast
import re

import pytest

from runner.environment import CHECKOUT

# What Blender's own import and export classes bring, and what only the file browser looks at.
OF_THE_FILE_BROWSER = {"rna_type", "filter_glob", "check_existing", "hide_props_region"}


@pytest.fixture(scope="module")
def text():
    return (CHECKOUT / "docs" / "API.md").read_text(encoding="utf-8")


@pytest.fixture
def operators(blender):
    return {name: getattr(blender.ops.nfm, name).get_rna_type() for name in dir(blender.ops.nfm)}


def documented_operators(text):
    """Arguments as written, and text of the entry, by name."""
    section = text.split("## Operators")[1].split("\n## ")[0]
    entries = re.split(r"\n(?=`bpy\.ops\.nfm\.)", section)[1:]
    found = {}
    for entry in entries:
        heading = entry.split("\n: ")[0]
        for name, arguments in re.findall(r"`(?:bpy\.ops\.nfm\.)?(\w+)\((.*?)\)`", heading):
            found[name] = (arguments, entry)
    return found


def argument_values(arguments):
    """What stands in the parentheses: defaults by name; None where there is none."""
    call = ast.parse(f"f({arguments})", mode="eval").body
    values = {item.arg: ast.literal_eval(item.value) for item in call.keywords}
    return {item.id: None for item in call.args if isinstance(item, ast.Name)} | values


def test_every_operator_is_documented_and_no_other(text, operators):
    assert set(documented_operators(text)) == set(operators)


def test_every_argument_is_documented_with_its_default(text, operators):
    for name, (arguments, entry) in documented_operators(text).items():
        values = argument_values(arguments)
        properties = {
            key: item
            for key, item in operators[name].properties.items()
            if key not in OF_THE_FILE_BROWSER
        }
        assert set(values) <= set(properties), name
        for key, item in properties.items():
            assert key in values, f"{name}: {key} is not in the heading"
            if isinstance(values[key], (str, bool, int, float)) and values[key] != "":
                default = getattr(item, "default", None)
                assert values[key] == pytest.approx(default), f"{name}: {key}"
            if item.type == "ENUM" and len(item.enum_items) < 6:
                missing = [
                    i.identifier for i in item.enum_items if f"'{i.identifier}'" not in entry
                ]
                assert not missing or values[key] is None, f"{name}: {key}: {missing}"


@pytest.mark.parametrize(
    ("kind", "section"),
    [
        ("NFM_PG_material", "## material.nfm\n"),
        ("NFM_PG_edit", "### material.nfm.edit\n"),
        ("NFM_PG_lobe_sliders", "### material.nfm.edit\n"),
        ("NFM_AP_preferences", "## Preferences\n"),
        ("NFM_PG_plot", "## window_manager.nfm_plot\n"),
    ],
)
def test_every_property_is_documented(kind, section, text, blender, addon):
    assert section in text
    body = re.split(r"\n##+ ", text.split(section)[1])[0]
    kinds = {
        "NFM_AP_preferences": addon("preferences").NFM_AP_preferences,
        "NFM_PG_material": addon("properties").NFM_PG_material,
        "NFM_PG_plot": addon("plot_icons").NFM_PG_plot,
    }
    owner = kinds.get(kind) or getattr(addon("edit_properties"), kind)
    inherited = {"rna_type", "name", "bl_idname"}
    for name, item in owner.bl_rna.properties.items():
        if name not in inherited and not item.is_hidden and item.type != "POINTER":
            assert f"`{name}`" in body or re.search(rf"`\w+` to `{name}`", body), name


def test_operators_say_what_they_do(operators):
    for name, kind in operators.items():
        assert kind.name, name
        assert len(kind.description) > 20, name
        for key, item in kind.properties.items():
            if key not in OF_THE_FILE_BROWSER and not item.is_hidden:
                assert item.name, f"{name}.{key}"
                assert item.description, f"{name}.{key}"


def test_an_operator_that_cannot_run_says_why(blender, operators):
    """In an empty scene hardly any can."""
    refused = 0
    for name in operators:
        operator = getattr(blender.ops.nfm, name)
        if operator.poll():
            continue
        refused += 1
        with pytest.raises(RuntimeError) as caught:
            operator()
        message = str(caught.value)
        assert "context is incorrect" not in message, name
        assert len(message.partition(".poll()")[2]) > 15, message
    assert refused > 10
