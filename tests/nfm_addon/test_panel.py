"""The panel "Measured BRDF". Nothing is drawn in the background: a layout here takes notes."""

from types import SimpleNamespace

import pytest

from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS, MODELS


class Notes:
    """Stands in for a UILayout, and refuses what Blender would."""

    def __init__(self, blender, lines):
        self.blender, self.lines = blender, lines
        self.use_property_split = self.use_property_decorate = False

    def label(self, *, text="", icon="NONE", icon_value=0, translate=True):
        items = self.blender.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        assert icon in items
        assert isinstance(icon_value, int)
        if text:
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

    def separator(self):
        pass

    def box(self):
        return Notes(self.blender, self.lines)

    def row(self, align=False):
        return self.box()

    column = row

    def split(self, *, factor, align):
        assert 0 < factor < 1
        return self.box()

    def panel(self, name):
        return self.box(), self.box()


@pytest.fixture
def material(addon, fitted):
    return addon("material").build(fitted)


@pytest.fixture
def drawn(blender, addon):
    """What the panel shows of a material in the scene."""

    def draw(material, width=600):
        lines = []
        context = SimpleNamespace(
            material=material,
            scene=blender.context.scene,
            preferences=SimpleNamespace(
                addons=blender.context.preferences.addons,
                system=SimpleNamespace(ui_scale=1.0),  # 0 in the background
            ),
            region=SimpleNamespace(width=width),
            window_manager=blender.context.window_manager,
        )
        panel = SimpleNamespace(layout=Notes(blender, lines))
        panel.bl_label = "Measured BRDF"
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


def test_comes_before_the_panels_of_every_material(blender):
    """Where Blender puts those without a header; it has a heading of its own."""
    assert "HIDE_HEADER" in blender.types.NFM_PT_material.bl_options


@pytest.mark.parametrize("kind", ["material", "none"])
def test_poll_of_the_shader_editor(kind, blender, material):
    context = SimpleNamespace(**({"material": material} if kind == "material" else {}))
    assert blender.types.NFM_PT_material_nodes.poll(context) is (kind == "material")
    assert blender.types.NFM_PT_material_nodes.bl_space_type == "NODE_EDITOR"


# ---- what ----


@pytest.mark.osl
def test_shows_everything_in_order(material, drawn):
    settings = material.nfm
    settings.native_error, settings.native_psnr, settings.native_share = 0.01234, 45.6, 0.985
    settings.studio_psnr = 46.2
    facts = (
        ("File", "blue.binary (MERL)"),
        ("Model", "3 lobes, 822 numbers"),
        ("PSNR", "46 dB, no visible error"),
        ("Native Lobes", "98.5 % of the light"),
    )
    assert drawn(material) == [
        ("label", "Measured BRDF", "NONE"),
        *(("label", text, "NONE") for fact in facts for text in fact),
        ("prop", "sampling"),
        ("label", "Error", "NONE"),
        ("label", "1.23 %, 46 dB", "NONE"),
        ("prop", "default_value", "Diffuse"),
        *(
            line
            for lobe in (1, 2, 3)
            for line in (
                ("prop", "default_value", f"Lobe {lobe} Scale"),
                ("prop", "solo"),
                ("prop", "mute"),
            )
        ),
        *(
            ("operator", f"nfm.{name}")
            for name in (
                "refit",
                "replace_measurement",
                "export_parameters",
                "export_measurement",
                "save_edits",
                "load_edits",
                "reset_material",
            )
        ),
        ("label", "Plot", "NONE"),
        ("prop", "kind"),
        ("icon", 12.0),
        ("label", "Facets at 0 to 90\N{DEGREE SIGN}, 4 decades", "NONE"),
        *(("label", f"Lobe {lobe}", "NONE") for lobe in (1, 2, 3)),
        ("prop", "size"),
    ]


@pytest.mark.osl
def test_fits_into_a_narrow_panel(blender, material, drawn):
    blender.context.scene.cycles.shading_system = False
    blender.context.scene.render.engine = "BLENDER_WORKBENCH"
    wide, narrow = drawn(material), drawn(material, width=180)
    assert ("label", "The render engine is not Cycles; it shows a stand-in", "ERROR") in wide
    assert ("label", "The render", "ERROR") in narrow
    assert max(len(line[1]) for line in narrow if line[2:] == ("BLANK1",)) <= 24
    (plot,) = [line[1] for line in narrow if line[0] == "icon"]
    assert plot < 12


@pytest.mark.parametrize("kind", ["NDF", "FRESNEL", "MASKING", "SLICES"])
def test_every_plot_has_a_legend(kind, blender, material, drawn):
    blender.context.window_manager.nfm_plot.kind = kind
    lines = drawn(material)
    after = lines[[line[0] for line in lines].index("icon") + 1 :]
    assert len([line for line in after if line[0] == "label"]) >= 4


def test_linked_material_offers_to_be_made_editable(blender, material, drawn, tmp_path):
    material.use_fake_user = True
    name, path = material.name, tmp_path / "library.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    blender.context.scene.render.engine = "CYCLES"
    with blender.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.materials = [name]
    linked = blender.data.materials[name]
    lines = drawn(linked)
    assert ("label", "Linked from library.blend", "LINKED") in lines
    assert ("operator", "nfm.make_editable") in lines
    item = linked.override_create(remap_local_usages=True)
    assert ("operator", "nfm.make_editable") in drawn(item)
    item.nfm.edit.lobe_1.gain = 0.5
    blender.ops.nfm.apply_edits()
    lines = drawn(item)
    assert ("operator", "nfm.make_editable") not in lines
    assert any(line[1].startswith("Library override: colours typed") for line in lines)


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


@pytest.mark.osl
def test_offers_to_set_up_rendering(blender, material, drawn):
    assert ("operator", "nfm.set_up_render") not in drawn(material)
    blender.context.scene.cycles.shading_system = False
    lines = drawn(material)
    assert ("label", "Open Shading Language is off", "ERROR") in lines
    assert ("operator", "nfm.set_up_render") in lines


@pytest.mark.osl
def test_without_a_source(material, texts):
    material.nfm.source = ""
    assert texts(material)[1:3] == ["Model", "3 lobes, 822 numbers"]


def test_a_material_without_its_nodes_is_told(material, texts):
    material.node_tree.nodes.clear()
    assert any("has no NFM BRDF node any more" in text for text in texts(material))


def test_damaged_parameters_are_told(material, texts):
    material.nfm.parameters = "{"
    assert any("not valid JSON" in text for text in texts(material))


@pytest.mark.parametrize("sampling", ["SMOOTH", "EXACT", "REFERENCE", "COSINE"])
def test_error_of_native_is_not_that_of_others(sampling, material, texts):
    material.nfm.sampling = sampling
    assert "Error" not in texts(material)


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
    lines = texts(material)
    assert lines[lines.index("Error") + 1].startswith("0.")


def test_main_direction(addon, drawn, texts, material):
    brushed = FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"])
    item = addon("material").build(brushed, "REFERENCE")
    direction = item.nfm.anisotropy_direction
    shown = texts(item)
    expected = f"{direction:.1f}\N{DEGREE SIGN} from the tangent"
    assert shown[shown.index("Main Direction") + 1] == expected
    lines = drawn(item)
    assert ("prop", "default_value", "Rotation") in lines
    assert ("operator", "nfm.align_brushing") in lines
    item.nfm.anisotropy_strength = 0.01
    shown = texts(item)
    assert shown[shown.index("Main Direction") + 1] == "None"
    # one that is the same in all directions is not spoken of
    assert ("operator", "nfm.align_brushing") not in drawn(material)
