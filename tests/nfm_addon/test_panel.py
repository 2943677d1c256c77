"""The panel "Measured BRDF". Nothing is drawn in the background: a layout here takes notes."""

from types import SimpleNamespace

import pytest

from fitter.parameter_file import FittedMaterial
from tests.models import MODELS


class Notes:
    """Stands in for a UILayout, and refuses what Blender would."""

    def __init__(self, blender, lines):
        self.blender, self.lines = blender, lines
        self.use_property_split = False

    def label(self, *, text, icon="NONE", translate=True):
        items = self.blender.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        assert icon in items
        self.lines.append(("label", text, icon, translate))

    def prop(self, data, name):
        assert name in data.bl_rna.properties
        self.lines.append(("prop", name))

    def operator(self, name):
        category, _, function = name.partition(".")
        assert function in dir(getattr(self.blender.ops, category))
        self.lines.append(("operator", name))

    def box(self):
        self.lines.append(("box",))
        return Notes(self.blender, self.lines)


@pytest.fixture
def material(addon, fitted):
    return addon("material").build(fitted)


@pytest.fixture
def drawn(blender, addon):
    """What the panel shows of a material in the scene."""

    def draw(material):
        lines = []
        context = SimpleNamespace(material=material, scene=blender.context.scene)
        panel = SimpleNamespace(layout=Notes(blender, lines))
        addon("panel").NFM_PT_material.draw(panel, context)
        return lines

    return draw


@pytest.fixture
def texts(drawn):
    def of(material):
        return [line[1] for line in drawn(material) if line[0] == "label"]

    return of


def new_lamp(blender, name, size):
    lamp = blender.data.lights.new(name, "POINT")
    lamp.shadow_soft_size = size
    blender.context.scene.collection.objects.link(blender.data.objects.new(name, lamp))


# ---- where ----


def test_stands_with_the_properties_of_a_material(blender):
    panel = blender.types.NFM_PT_material
    assert panel.is_registered
    assert panel.bl_label == "Measured BRDF"
    where = (panel.bl_space_type, panel.bl_region_type, panel.bl_context)
    assert where == ("PROPERTIES", "WINDOW", "material")


def test_poll(blender, material):
    poll = blender.types.NFM_PT_material.poll
    assert poll(SimpleNamespace(material=material)) is True
    plain = blender.data.materials.new("plain")
    assert poll(SimpleNamespace(material=plain)) is False
    assert poll(SimpleNamespace(material=None)) is False


# ---- what ----


def test_shows_source_sampling_and_error(material, drawn):
    material.nfm.native_error, material.nfm.native_psnr = 0.01234, 45.6
    assert drawn(material) == [
        ("label", "blue.binary", "NONE", False),
        ("prop", "sampling"),
        ("label", "Error 1.23 %, 46 dB", "NONE", False),
    ]


def test_without_a_source(material, drawn):
    material.nfm.source = ""
    assert drawn(material)[0] == ("prop", "sampling")


def test_error_is_that_of_the_base(material, texts):
    percent = f"{100 * material.nfm.native_error:.2f} %"
    assert percent != "0.00 %"
    assert percent in texts(material)[-1]


@pytest.mark.parametrize("sampling", ["SMOOTH", "EXACT", "REFERENCE", "COSINE"])
def test_error_of_native_is_not_that_of_others(sampling, material, texts):
    material.nfm.sampling = sampling
    assert texts(material) == ["blue.binary"]


@pytest.mark.parametrize("sampling", ["REFERENCE", "COSINE"])
def test_names_the_lamps_that_are_not_seen(sampling, blender, material, drawn):
    material.nfm.sampling = sampling
    new_lamp(blender, "Large", 0.2)
    assert ("box",) not in drawn(material)
    for name in ("Rim", "Key"):
        new_lamp(blender, name, 0.0)
    assert drawn(material)[-3:] == [
        ("box",),
        ("label", "Not seen: Key, Rim", "ERROR", True),
        ("operator", "nfm.give_lamps_size"),
    ]
    blender.ops.nfm.give_lamps_size()
    assert ("box",) not in drawn(material)


@pytest.mark.parametrize("sampling", ["NATIVE", "SMOOTH", "EXACT"])
def test_samplings_with_a_base_see_every_lamp(sampling, blender, material, drawn):
    new_lamp(blender, "Key", 0.0)
    material.nfm.sampling = sampling
    assert ("box",) not in drawn(material)


@pytest.mark.parametrize("name", ["metal", "velvet"])
def test_draws_any_material(name, addon, texts):
    material = addon("material").build(FittedMaterial("%s {0} \n", MODELS[name]))
    assert "Error 0." in texts(material)[-1]
