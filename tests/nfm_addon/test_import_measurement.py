"""bpy.ops.nfm.import_measurement."""

import importlib
import os
import tempfile

import numpy as np
import pytest

from fitter import synthetic
from fitter.fitting.quality import QUALITIES
from fitter.formats import merl, parameter_file, utia
from fitter.formats.parameter_file import FittedMaterial
from tests.models import ANISOTROPIC_MODELS


@pytest.fixture
def import_file(addon, blender):
    def run(path, **options):
        return blender.ops.nfm.import_measurement(filepath=os.fspath(path), **options)

    return run


@pytest.fixture
def slots():
    """Materials in the slots of an object."""

    def of(item):
        return [slot.material and slot.material.name for slot in item.material_slots]

    return of


def linked_from_file(blender, tmp_path, names):
    """Write datablocks to a library, empty the scene and link them from there."""
    path = tmp_path / "library.blend"
    kinds = {
        kind: [item for item in getattr(blender.data, kind) if item.name in names]
        for kind in ("meshes", "objects")
    }
    blender.data.libraries.write(str(path), {item for kind in kinds.values() for item in kind})
    wanted = {kind: [item.name for item in items] for kind, items in kinds.items()}
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with blender.data.libraries.load(str(path), link=True) as (_, target):
        target.meshes, target.objects = wanted["meshes"], wanted["objects"]
    return target


def activate(blender, item):
    blender.context.scene.collection.objects.link(item)
    blender.context.view_layer.objects.active = item


# ---- where the material goes ----


def test_object_without_slots_gets_one(import_file, parameter_path, mesh_object, slots):
    item = mesh_object()
    assert import_file(parameter_path) == {"FINISHED"}
    assert slots(item) == ["blue plastic"]
    assert item.material_slots[0].link == "DATA"


def test_active_slot_is_replaced(import_file, parameter_path, mesh_object, slots):
    item = mesh_object(slots=3)
    item.active_material_index = 1
    import_file(parameter_path)
    assert slots(item) == ["old 0", "blue plastic", "old 2"]


def test_active_camera_is_left_alone(blender, import_file, parameter_path, capfd):
    camera = blender.data.objects.new("Camera", blender.data.cameras.new("Camera"))
    activate(blender, camera)
    assert import_file(parameter_path) == {"FINISHED"}
    assert blender.data.materials["blue plastic"].use_fake_user
    assert "no selected object takes materials" in capfd.readouterr().out


def test_no_active_object(blender, import_file, parameter_path, capfd):
    assert blender.context.active_object is None
    assert import_file(parameter_path) == {"FINISHED"}
    material = blender.data.materials["blue plastic"]
    assert material.use_fake_user
    assert "Warning: blue plastic is in the material list" in capfd.readouterr().out


def test_material_on_an_object_needs_no_fake_user(
    blender, import_file, parameter_path, mesh_object
):
    mesh_object()
    import_file(parameter_path)
    assert not blender.data.materials["blue plastic"].use_fake_user


def test_linked_mesh_with_a_slot_is_overridden_on_the_object(
    blender, import_file, parameter_path, mesh_object, slots, tmp_path
):
    mesh_object(slots=1)
    library = linked_from_file(blender, tmp_path, {"Thing"})
    item = blender.data.objects.new("Local", library.meshes[0])
    activate(blender, item)
    assert import_file(parameter_path) == {"FINISHED"}
    assert slots(item) == ["blue plastic"]
    assert item.material_slots[0].link == "OBJECT"
    assert [material.name for material in item.data.materials] == ["old 0"]


def test_linked_mesh_without_slots_cannot_take_it(
    blender, import_file, parameter_path, mesh_object, slots, tmp_path
):
    mesh_object()
    library = linked_from_file(blender, tmp_path, {"Thing"})
    item = blender.data.objects.new("Local", library.meshes[0])
    activate(blender, item)
    assert import_file(parameter_path) == {"FINISHED"}
    assert slots(item) == []
    assert blender.data.materials["blue plastic"].use_fake_user


@pytest.mark.parametrize("count", [0, 1])
def test_linked_object_cannot_take_it(
    count, blender, import_file, parameter_path, mesh_object, slots, tmp_path
):
    mesh_object(slots=count)
    library = linked_from_file(blender, tmp_path, {"Thing"})
    item = library.objects[0]
    activate(blender, item)
    assert import_file(parameter_path) == {"FINISHED"}
    assert slots(item) == ["old 0"][:count]
    assert [slot.link for slot in item.material_slots] == ["DATA"][:count]
    assert blender.data.materials["blue plastic"].use_fake_user


def test_selected_objects_get_it_and_the_active_one_only_if_none_is(
    blender, import_file, parameter_path, mesh_object, slots
):
    items = [mesh_object() for _ in range(3)]
    for item in items[:2]:
        item.select_set(True)
    import_file(parameter_path)
    assert [slots(item) for item in items] == [["blue plastic"], ["blue plastic"], []]


def test_assigns_nothing_if_asked(blender, import_file, parameter_path, mesh_object, slots):
    item = mesh_object(slots=1)
    import_file(parameter_path, assign=False)
    assert slots(item) == ["old 0"]
    assert blender.data.materials["blue plastic"].use_fake_user


def test_several_files_at_once(blender, import_file, fitted, mesh_object, slots, tmp_path):
    for name in ("a", "b"):
        path = tmp_path / f"{name}.nfm.json"
        parameter_file.save(path, FittedMaterial(name, fitted.model))
    item = mesh_object()
    files = [{"name": "a.nfm.json"}, {"name": "b.nfm.json"}]
    assert import_file("", directory=str(tmp_path), files=files) == {"FINISHED"}
    assert slots(item) == ["a"]
    assert blender.data.materials["b"].use_fake_user


def test_one_bad_file_of_several_does_not_stop_the_others(
    blender, import_file, parameter_path, mesh_object, slots
):
    item = mesh_object()
    files = [{"name": "none.nfm.json"}, {"name": parameter_path.name}]
    with pytest.raises(RuntimeError, match=r"none\.nfm\.json: no such file"):
        import_file("", directory=str(parameter_path.parent), files=files)
    assert "blue plastic" in blender.data.materials
    assert slots(item) == []


def test_marked_as_asset_with_tags_and_a_picture(import_file, parameter_path, mesh_object):
    item = mesh_object()
    import_file(parameter_path, as_asset=True)
    material = item.active_material
    assert [tag.name for tag in material.asset_data.tags] == ["measured", "merl"]
    assert material.asset_data.description == "Measured BRDF: blue.binary"
    pixels = np.array(material.preview.image_pixels_float).reshape(128, 128, 4)
    assert pixels[64, 64, 3] == 1
    assert pixels[0, 0, 3] == 0
    assert pixels[..., 2].sum() > pixels[..., 0].sum() > 0


def test_no_asset_by_default(import_file, parameter_path, mesh_object):
    item = mesh_object()
    import_file(parameter_path)
    assert item.active_material.asset_data is None


# ---- the fit ----


@pytest.mark.parametrize(
    ("options", "expected"), [({}, "standard"), ({"quality": "DRAFT"}, "draft")]
)
def test_quality_reaches_the_fit(
    addon, import_file, parameter_path, mesh_object, fitted, monkeypatch, options, expected
):
    seen = []

    def fit(path, *, encoding, quality, on_step):
        seen.append(quality)
        return fitted

    monkeypatch.setattr(addon("operators.import_measurement"), "material_from_file", fit)
    mesh_object()
    import_file(parameter_path, **options)
    assert seen == [expected]


def test_every_encoding_of_the_fitter_is_offered(addon):
    properties = addon("properties")
    names = [identifier for identifier, *_ in properties.ENCODING_ITEMS]
    assert names == [properties.AUTOMATIC, *utia.ENCODINGS]


def test_every_quality_of_the_fitter_is_offered(addon):
    items = addon("properties").QUALITY_ITEMS
    assert [identifier.lower() for identifier, *_ in items] == list(QUALITIES)


# ---- what is made ----


def test_makes_a_material_a_group_and_a_text(
    blender, addon, import_file, parameter_path, mesh_object, all_names
):
    item = mesh_object()
    before = all_names()
    import_file(parameter_path)
    after = all_names()
    new = {kind: sorted(set(after[kind]) - set(before[kind])) for kind in after}
    assert {kind: names for kind, names in new.items() if names} == {
        "materials": ["blue plastic"],
        "node_groups": ["NFM BRDF"],
        "texts": ["blue plastic.osl"],
    }
    script = addon("material").find_script_node(item.active_material)
    assert script.script == blender.data.texts["blue plastic.osl"]
    # they vanish together with the material
    assert script.script.users == 1
    assert not script.script.use_fake_user
    assert blender.data.node_groups["NFM BRDF"].users == 1


def test_leaves_no_temporary_files(import_file, parameter_path, mesh_object, tmp_path, monkeypatch):
    mesh_object()
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    import_file(parameter_path)
    assert list(folder.iterdir()) == []


@pytest.mark.osl
@pytest.mark.parametrize("engine", ["BLENDER_WORKBENCH", "EEVEE", "CYCLES"])
def test_compiles_under_any_engine(
    engine, blender, addon, import_file, parameter_path, mesh_object
):
    if engine == "EEVEE":
        engine = "BLENDER_EEVEE_NEXT" if blender.app.version < (5, 0) else "BLENDER_EEVEE"
    blender.context.scene.render.engine = engine
    item = mesh_object()
    import_file(parameter_path)
    assert blender.context.scene.render.engine == engine
    script = addon("material").find_script_node(item.active_material)
    assert script.bytecode.startswith("OpenShadingLanguage")
    assert len(script.bytecode_hash) == 32
    assert script.outputs["BSDF"].is_linked


def test_fields_are_filled(blender, import_file, parameter_path, mesh_object):
    item = mesh_object()
    import_file(parameter_path, sampling="COSINE")
    settings = item.active_material.nfm
    assert settings.source == "blue.binary"
    assert settings.source_format == "MERL"
    assert settings.model == "shared3"
    assert settings.objective == pytest.approx(0.00125)
    assert settings.iterations == 57
    assert settings.mean_log_error == 0.125
    assert settings.largest_directional_albedo == 0.75
    assert settings.sampling == "COSINE"
    # a sampling of mirrors has no base to tell the error of
    assert (settings.native_error, settings.native_psnr) == (0, 0)


def test_error_of_native_sampling_is_told(import_file, parameter_path, mesh_object, capfd):
    item = mesh_object()
    import_file(parameter_path)
    error = 100 * item.active_material.nfm.native_error
    assert f"error of native sampling {error:.2f} %" in capfd.readouterr().out
    import_file(parameter_path, sampling="EXACT")
    assert "native" not in capfd.readouterr().out


def test_native_sampling_by_default(addon, import_file, parameter_path, mesh_object, native_error):
    item = mesh_object()
    import_file(parameter_path)
    settings = item.active_material.nfm
    assert settings.sampling == "NATIVE"
    assert settings.native_error == pytest.approx(native_error.image, rel=1e-6)
    assert settings.native_psnr == pytest.approx(native_error.psnr, rel=1e-6)
    source = addon("material").find_script_node(item.active_material).script.as_string()
    assert "sum = base_lobes(" in source


def test_material_holds_the_model_of_the_file(addon, import_file, parameter_path, mesh_object):
    item = mesh_object()
    import_file(parameter_path)
    assert item.active_material.nfm.parameters == parameter_path.read_text(encoding="utf-8")
    loaded = addon("material").fitted_material(item.active_material)
    expected = parameter_file.load(parameter_path)
    for name in ("diffuse", "scale", "ndf", "masking", "fresnel"):
        np.testing.assert_array_equal(getattr(loaded.model, name), getattr(expected.model, name))


@pytest.mark.parametrize("iterations", [10**12, -(10**12), 3.5, 3])
def test_strange_figures_do_no_harm(
    iterations, import_file, fitted, mesh_object, tmp_path, all_names
):
    path = tmp_path / "strange.nfm.json"
    fit = {"objective": 3, "iterations": iterations, "mean_log_error": "none"}
    parameter_file.save(path, FittedMaterial("strange", fitted.model, None, fit))
    item = mesh_object()
    assert import_file(path) == {"FINISHED"}
    settings = item.active_material.nfm
    assert settings.iterations == np.clip(int(iterations), -(2**31) + 1, 2**31 - 1)
    assert (settings.objective, settings.mean_log_error, settings.source) == (3, 0, "")


@pytest.mark.osl
def test_imports_are_independent(blender, addon, import_file, parameter_path, mesh_object):
    materials = []
    for _ in range(2):
        item = mesh_object()
        import_file(parameter_path)
        materials.append(item.active_material)
    assert [material.name for material in materials] == ["blue plastic", "blue plastic.001"]
    first, second = (addon("material").find_script_node(material) for material in materials)
    assert first.id_data != second.id_data
    assert first.script != second.script
    before = (first.script.as_string(), first.bytecode)
    materials[1].nfm.sampling = "COSINE"
    assert (first.script.as_string(), first.bytecode) == before
    assert second.bytecode != first.bytecode
    assert materials[0].nfm.sampling == "NATIVE"


def test_fits_a_merl_file(
    blender, addon, extension, import_file, mesh_object, tmp_path, monkeypatch, slots
):
    """The whole way from a measured file, with a fit cut short."""
    quality = importlib.import_module(f"{extension.__name__}.fitter.fitting.quality")
    short = quality.Quality(
        starts=1,
        sweeps=4,
        explore_steps=0,
        finalists=1,
        final_steps=0,
        refine_steps=1,
        appearance_steps=1,
        maps=1,
        coarse_phi_group=15,
        coarse_angles=180,
        polish_steps=1,
        polish_angles=180,
    )
    monkeypatch.setitem(quality.QUALITIES, "standard", short)
    path = tmp_path / "rough copper.binary"
    synthetic.write_sample(path, "brushed-copper")
    item = mesh_object()
    assert import_file(path) == {"FINISHED"}
    assert slots(item) == ["rough copper"]
    settings = item.active_material.nfm
    assert settings.source == "rough copper.binary"
    assert settings.source_format == merl.read(path).source.format
    assert 0 < settings.objective < 1e-2
    assert 0 < settings.mean_log_error < 0.2
    assert 0.5 < settings.largest_directional_albedo < 1.1
    # 4 sweeps, a joint step, one that sees the albedo, the first and the last of the polish
    assert settings.iterations == 8
    # it has the colour of copper; its brightness takes a longer fit
    up = np.array([[0.0, 0.0, 1.0]])
    model = addon("material").fitted_material(item.active_material).model
    found, expected = model.f_r(up, up)[0], synthetic.SAMPLES["brushed-copper"].f_r(up, up)[0]
    np.testing.assert_allclose(found / found[0], expected / expected[0], rtol=0.05)


# ---- what goes wrong ----

BROKEN = {
    "missing.binary": (None, "missing.binary: no such file"),
    "missing.nfm.json": (None, "missing.nfm.json: no such file"),
    "truncated.binary": (merl.HEADER + bytes(1000), "truncated.binary: 1,012 bytes"),
    "broken.nfm.json": (b'{"format": "nfm", ', "broken.nfm.json: not valid JSON"),
    "foreign.nfm.json": (b'{"format": "gltf"}', 'foreign.nfm.json: no "format"'),
    "new\nline.binary": (bytes(7), r"new\\nline.binary: 7 bytes"),
    "new\nline missing.binary": (None, r"new\\nline missing.binary: no such file"),
    "folder.binary": ("folder", "folder.binary: a folder"),
    "empty.binary": (b"", "empty.binary: "),
}


@pytest.mark.parametrize("name", BROKEN, ids=lambda name: name.replace("\n", "|"))
def test_unusable_file_is_refused_and_leaves_nothing(
    name, blender, import_file, mesh_object, slots, all_names, tmp_path
):
    content, message = BROKEN[name]
    path = tmp_path / name
    if content == "folder":
        path.mkdir()
    elif content is not None:
        path.write_bytes(content)
    item = mesh_object(slots=2)
    before = all_names()
    with pytest.raises(RuntimeError, match=message) as caught:
        import_file(path)
    # one line for the user, and not Blender's report of a Python error
    assert str(caught.value).count("\n") == 1
    assert str(caught.value).startswith("Error: ")
    assert "Python" not in str(caught.value)
    assert all_names() == before
    assert slots(item) == ["old 0", "old 1"]


@pytest.mark.osl
def test_shader_that_does_not_compile_leaves_nothing(
    addon, import_file, parameter_path, mesh_object, slots, all_names, monkeypatch
):
    monkeypatch.setattr(
        addon("material"),
        "new_surface",
        lambda *_, **__: addon("shader_source").Surface("shader broken(", np.zeros((3, 1, 3))),
    )
    item = mesh_object(slots=1)
    before = all_names()
    with pytest.raises(RuntimeError, match="Error: Cycles could not compile the shader"):
        import_file(parameter_path)
    assert all_names() == before
    assert slots(item) == ["old 0"]


# ---- undo ----
#
# In the background Blender keeps no undo steps until ed.undo_push is called for the first time, and
# the add-on makes none. Where the fixture `undo_steps` has it make them, undo and redo work as in a
# window (4.5 and 5.2 alike).


def test_undo_and_redo_around_an_import(
    blender, import_file, parameter_path, mesh_object, slots, all_names
):
    mesh_object(slots=1)
    blender.ops.ed.undo_push(message="before")
    before = all_names()
    import_file(parameter_path)
    blender.ops.ed.undo_push(message="after")

    assert blender.ops.ed.undo() == {"FINISHED"}
    assert slots(blender.data.objects["Thing"]) == ["old 0"]
    assert all_names() == before
    assert blender.ops.ed.redo() == {"FINISHED"}
    assert slots(blender.data.objects["Thing"]) == ["blue plastic"]


@pytest.mark.osl
def test_import_is_one_undo_step(
    blender,
    addon,
    import_file,
    parameter_path,
    mesh_object,
    slots,
    render,
    sphere_scene,
    undo_steps,
):
    mesh_object()
    blender.ops.ed.undo_push(message="before")
    import_file(parameter_path)
    assert undo_steps == ["Import Measured BRDF"]
    assert blender.ops.ed.undo() == {"FINISHED"}
    assert slots(blender.data.objects["Thing"]) == []
    assert "blue plastic" not in blender.data.materials
    assert blender.ops.ed.redo() == {"FINISHED"}
    assert slots(blender.data.objects["Thing"]) == ["blue plastic"]
    # what came back is alive: its shader renders, and can be written anew
    material = blender.data.materials["blue plastic"]
    assert render(sphere_scene(material)).std() > 0.01
    material.nfm.sampling = "COSINE"
    assert addon("material").find_script_node(material).inputs["Candidates"].is_linked is False


def test_refused_file_is_no_undo_step(
    blender, import_file, mesh_object, slots, tmp_path, undo_steps
):
    item = mesh_object()
    blender.ops.ed.undo_push(message="before")
    item.data.materials.append(None)
    blender.ops.ed.undo_push(message="a slot")
    with pytest.raises(RuntimeError, match="no such file"):
        import_file(tmp_path / "none.binary")
    assert undo_steps == []
    blender.ops.ed.undo()
    assert slots(blender.data.objects["Thing"]) == []


def test_anisotropic_material_has_base_lobes_and_a_frame(import_file, blender, tmp_path):
    path = tmp_path / "brushed.nfm.json"
    parameter_file.save(path, FittedMaterial("brushed", ANISOTROPIC_MODELS["brushed"]))
    import_file(path, sampling="NATIVE")
    (material,) = blender.data.materials
    assert material.nfm.sampling == "NATIVE"
    assert 0 < material.nfm.native_error < 0.02
    (group,) = blender.data.node_groups
    inputs = [item.name for item in group.interface.items_tree if item.in_out == "INPUT"]
    assert inputs[-3:] == ["Normal", "Tangent", "Rotation"]


def test_an_encoding_is_for_files_that_have_a_choice(addon, import_file, tmp_path, monkeypatch):
    asked = []

    def fit(path, *, encoding, **_options):
        asked.append(encoding)
        raise addon("errors").ShaderError(f"{path}: not fitted")

    monkeypatch.setattr(addon("operators.import_measurement"), "material_from_file", fit)
    for name in ("a.bin", "b.binary"):
        (tmp_path / name).write_bytes(bytes(100))
        with pytest.raises(RuntimeError, match="not fitted"):
            import_file(tmp_path / name, encoding="srgb-140")
    assert asked == ["srgb-140", None]
