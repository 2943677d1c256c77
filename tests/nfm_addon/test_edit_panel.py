# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel "Lobes & Curves". Nothing is drawn in the background: a layout here takes notes."""

from types import SimpleNamespace

import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS


class Notes:
    """Stands in for a UILayout with all panels open, and refuses what Blender would."""

    def __init__(self, blender, lines):
        self.blender, self.lines = blender, lines
        self.use_property_split = False

    def label(self, *, text, icon="NONE", translate=True):
        self._check("label", text=text, icon=icon, translate=translate)
        self.lines.append(("label", text))

    def prop(self, data, name, **options):
        assert name in data.bl_rna.properties
        self._check("prop", **options)
        self.lines.append(("prop", name))

    def operator(self, name, **options):
        category, _, function = name.partition(".")
        assert function in dir(getattr(self.blender.ops, category))
        self._check("operator", **options)
        kind = getattr(self.blender.ops.nfm, function).get_rna_type()
        self.lines.append(("operator", function))
        return _Arguments(kind)

    def template_curve_mapping(self, data, name, **options):
        assert isinstance(getattr(data, name), self.blender.types.CurveMapping)
        self._check("template_curve_mapping", **options)
        self.lines.append(("curve", data.name))

    def panel(self, name, default_closed=False):
        self._check("panel", idname=name, default_closed=default_closed)
        return Notes(self.blender, self.lines), Notes(self.blender, self.lines)

    def row(self, **options):
        self._check("row", **options)
        return Notes(self.blender, self.lines)

    def column(self, **options):
        self._check("column", **options)
        return Notes(self.blender, self.lines)

    def _check(self, function, **options):
        known = self.blender.types.UILayout.bl_rna.functions[function].parameters
        for option, value in options.items():
            assert option in known
            if option in ("icon", "type"):
                assert value in known[option].enum_items


class _Arguments:
    """Arguments of an operator, which must be there and take the value."""

    def __init__(self, kind):
        object.__setattr__(self, "kind", kind)

    def __setattr__(self, name, value):
        prop = self.kind.properties[name]
        assert prop.type != "ENUM" or value in prop.enum_items


@pytest.fixture
def material(addon):
    return addon("material").build(FittedMaterial("metal", MODELS["metal"]), "REFERENCE")


@pytest.fixture
def drawn(blender, addon):
    def draw(material, width=400):
        lines = []
        panel = SimpleNamespace(layout=Notes(blender, lines))
        context = SimpleNamespace(
            material=material,
            preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
            region=SimpleNamespace(width=width),
        )
        addon("edit_panel").NFM_PT_edit.draw(panel, context)
        draw.split = panel.layout.use_property_split
        return lines

    return draw


def test_stands_in_the_panel_of_the_material(blender, material):
    panel = blender.types.NFM_PT_edit
    assert panel.is_registered
    assert panel.bl_parent_id == blender.types.NFM_PT_material.bl_idname
    assert panel.poll(SimpleNamespace(material=material))
    material.node_tree.nodes.clear()
    assert not panel.poll(SimpleNamespace(material=material))


def test_names_stand_within_the_sliders_where_there_is_no_room_beside_them(material, drawn):
    wide = drawn(material)
    assert drawn.split is True
    assert drawn(material, width=240) == wide
    assert drawn.split is False


def test_shows_every_slider_and_curve(material, drawn):
    lines = drawn(material)
    names = [line[1] for line in lines if line[0] == "prop"]
    assert names[:5] == ["show_original", "width", "haze", "falloff", "gain"]
    assert names.count("gain") == 3
    for name in ("edge_tint", "edge_strength", "specular_saturation", "diffuse_hue"):
        assert name in names
    assert [line[1] for line in lines if line[0] == "curve"] == [
        *("Lobe 1 D", "Lobe 1 G", "Lobe 2 D", "Lobe 2 G", "Lobe 3 D", "Lobe 3 G", "F")
    ]
    used = {line[1] for line in lines if line[0] == "operator"}
    assert used >= {"copy_curve", "paste_curve", "copy_lobe", "paste_lobe", "reset_edits"}
    assert "blend_with" in used


def test_anisotropic_lobes_have_two_widths_and_curves_around(drawn, addon):
    fitted = FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"])
    lines = drawn(addon("material").build(fitted, "REFERENCE"))
    names = [line[1] for line in lines if line[0] == "prop"]
    assert names[1:7] == ["width", "width_along", "width_across", "haze", "falloff", "gain"]
    curves = [line[1] for line in lines if line[0] == "curve"]
    assert curves[:4] == ["Lobe 1 D", "Lobe 1 D around", "Lobe 1 G", "Lobe 1 G around"]
    assert len(curves) == 13


def test_removed_curve_can_be_brought_back(material, drawn, addon):
    group = addon("editing").group_of(material)
    group.nodes.remove(group.nodes["Lobe 2 G"])
    lines = drawn(material)
    assert ("curve", "Lobe 2 G") not in lines
    assert ("label", "Lobe 2 G") in lines


def test_too_much_light_is_told_with_a_way_out(blender, material, drawn, addon):
    assert ("operator", "keep_energy") not in drawn(material)
    material.nfm.edit.lobe_1.gain = 10.0
    lines = drawn(material)
    (text,) = [line[1] for line in lines if line[1].startswith("Reflects")]
    assert 200 < int(text.split()[1].rstrip("%")) < 2000
    assert ("operator", "keep_energy") in lines
    material.nfm.edit.keep_energy = True
    addon("editing").refresh(material)
    lines = drawn(material)
    assert ("prop", "keep_energy") in lines
    assert not [line for line in lines if line[1].startswith("Reflects")]


def test_blend_shows_its_slider_once_there_is_another(material, drawn):
    assert ("prop", "blend") not in drawn(material)
    material.nfm.edit.blend_name = "other"
    assert ("prop", "blend") in drawn(material)
