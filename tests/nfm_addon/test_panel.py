"""The panel "Measured BRDF". Nothing is drawn in the background: a layout here takes notes."""

from types import SimpleNamespace

import pytest

from fitter.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS


class Notes:
    """Stands in for a UILayout, and refuses what Blender would."""

    def __init__(self, blender, lines):
        self.blender, self.lines = blender, lines
        self.use_property_split = self.use_property_decorate = False

    def label(self, *, text, icon="NONE", translate=True):
        items = self.blender.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        assert icon in items
        assert translate is False
        self.lines.append(("label", text, icon))

    def prop(self, data, name, **options):
        assert name in data.bl_rna.properties
        assert options.keys() <= {"text", "index", "icon", "expand", "slider"}
        self.lines.append(("prop", name, *filter(None, [options.get("text")])))

    def operator(self, name):
        category, _, function = name.partition(".")
        assert function in dir(getattr(self.blender.ops, category))
        self.lines.append(("operator", name))

    def template_icon(self, *, icon_value, scale):
        assert isinstance(icon_value, int)
        self.lines.append(("icon", scale))

    def box(self):
        return Notes(self.blender, self.lines)

    def row(self, align=False):
        return self.box()

    column = row


@pytest.fixture
def material(addon, fitted):
    return addon("material").build(fitted)


@pytest.fixture
def drawn(blender, addon):
    """What the panel shows of a material in the scene."""

    def draw(material):
        lines = []
        context = SimpleNamespace(
            material=material,
            scene=blender.context.scene,
            preferences=blender.context.preferences,
            window_manager=blender.context.window_manager,
        )
        panel = SimpleNamespace(layout=Notes(blender, lines))
        addon("panel").NFM_PT_material.draw(panel, context)
        return lines

    return draw


@pytest.fixture
def texts(drawn):
    def of(material):
        return [line[1] for line in drawn(material) if line[0] == "label"]

    return of


@pytest.fixture(autouse=True)
def ready(blender):
    """A scene that renders measured materials."""
    blender.context.scene.render.engine = "CYCLES"
    blender.context.scene.cycles.shading_system = True


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


@pytest.mark.parametrize("kind", ["material", "none"])
def test_poll_of_the_shader_editor(kind, blender, material):
    context = SimpleNamespace(**({"material": material} if kind == "material" else {}))
    assert blender.types.NFM_PT_material_nodes.poll(context) is (kind == "material")
    assert blender.types.NFM_PT_material_nodes.bl_space_type == "NODE_EDITOR"


# ---- what ----


def test_shows_everything_in_order(material, drawn):
    settings = material.nfm
    settings.native_error, settings.native_psnr, settings.native_share = 0.01234, 45.6, 0.985
    settings.studio_psnr = 46.2
    assert drawn(material) == [
        ("label", "blue.binary (MERL)", "FILE"),
        ("label", "Three lobes, 822 numbers", "NONE"),
        ("label", "PSNR 46 dB: no visible difference", "NONE"),
        ("label", "98.5 % of its light in native lobes", "NONE"),
        ("prop", "sampling"),
        ("label", "Error 1.23 %, 46 dB", "NONE"),
        ("prop", "default_value", "Diffuse"),
        *(
            line
            for lobe in (1, 2, 3)
            for line in (
                ("prop", "default_value", f"Lobe {lobe}"),
                ("prop", "solo"),
                ("prop", "mute"),
            )
        ),
        ("prop", "kind"),
        ("icon", 11.0),
        ("prop", "size"),
        *(
            ("operator", f"nfm.{name}")
            for name in (
                "refit",
                "replace_measurement",
                "reset_material",
                "export_parameters",
                "save_edits",
                "load_edits",
            )
        ),
    ]


@pytest.mark.parametrize(
    ("name", "value", "warning"),
    [
        ("quality", "draft", "A draft: refit it for the final quality"),
        ("studio_psnr", 28, "The fit differs visibly from the measurement"),
        ("largest_directional_albedo", 1.2, "Reflects up to 120 % of the light"),
        ("native_error", 0.05, "Native sampling is far off: use Smooth or Exact"),
    ],
)
def test_warns(name, value, warning, material, drawn):
    assert ("label", warning, "ERROR") not in drawn(material)
    setattr(material.nfm, name, value)
    assert ("label", warning, "ERROR") in drawn(material)


def test_offers_to_set_up_rendering(blender, material, drawn):
    assert ("operator", "nfm.set_up_render") not in drawn(material)
    blender.context.scene.cycles.shading_system = False
    lines = drawn(material)
    assert ("label", "Open Shading Language is off", "ERROR") in lines
    assert ("operator", "nfm.set_up_render") in lines


def test_without_a_source(material, texts):
    material.nfm.source = ""
    assert texts(material)[0] == "Three lobes, 822 numbers"


def test_a_material_without_its_nodes_is_told(material, texts):
    material.node_tree.nodes.clear()
    assert any("has no NFM BRDF node any more" in text for text in texts(material))


def test_damaged_parameters_are_told(material, texts):
    material.nfm.parameters = "{"
    assert any("not valid JSON" in text for text in texts(material))


@pytest.mark.parametrize("sampling", ["SMOOTH", "EXACT", "REFERENCE", "COSINE"])
def test_error_of_native_is_not_that_of_others(sampling, material, texts):
    material.nfm.sampling = sampling
    assert not any(text.startswith("Error ") for text in texts(material))


@pytest.mark.parametrize("sampling", ["REFERENCE", "COSINE"])
def test_names_the_lamps_that_are_not_seen(sampling, blender, material, drawn):
    material.nfm.sampling = sampling
    new_lamp(blender, "Large", 0.2)
    assert ("operator", "nfm.give_lamps_size") not in drawn(material)
    for name in ("Rim", "Key"):
        new_lamp(blender, name, 0.0)
    lines = drawn(material)
    assert ("label", "Not seen: Key, Rim", "ERROR") in lines
    assert ("operator", "nfm.give_lamps_size") in lines
    blender.ops.nfm.give_lamps_size()
    assert ("operator", "nfm.give_lamps_size") not in drawn(material)


@pytest.mark.parametrize("sampling", ["NATIVE", "SMOOTH", "EXACT"])
def test_samplings_with_a_base_see_every_lamp(sampling, blender, material, drawn):
    new_lamp(blender, "Key", 0.0)
    material.nfm.sampling = sampling
    assert ("operator", "nfm.give_lamps_size") not in drawn(material)


@pytest.mark.parametrize("name", ["metal", "velvet"])
def test_draws_any_material(name, addon, texts):
    material = addon("material").build(FittedMaterial("%s {0} \n", MODELS[name]))
    assert any(text.startswith("Error 0.") for text in texts(material))


def test_main_direction(addon, drawn, texts, material):
    brushed = FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"])
    item = addon("material").build(brushed, "REFERENCE")
    direction = item.nfm.anisotropy_direction
    assert f"Main direction {direction:.1f}\N{DEGREE SIGN} from the tangent" in texts(item)
    lines = drawn(item)
    assert ("prop", "default_value", "Rotation") in lines
    assert ("operator", "nfm.align_brushing") in lines
    item.nfm.anisotropy_strength = 0.01
    assert "No main direction" in texts(item)
    # one that is the same in all directions is not spoken of
    assert ("operator", "nfm.align_brushing") not in drawn(material)
