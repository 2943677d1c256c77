# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does with the add-on, in a real window: blender --python session.py -- FOLDER.

FOLDER holds two measured files, first.binary and second.binary, and two fitted ones, third.nfm.json
and the anisotropic fourth.nfm.json, and gets the pictures. The add-on is installed and enabled.
"""

import sys
import time
from importlib import import_module
from pathlib import Path

import bpy
from bpy_extras import view3d_utils

sys.path.insert(0, str(Path(__file__).resolve().parent))
from driver import Window, run

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
HELD = 1.0  # CPU seconds at most of an import of a fitted file; 0.4 and more where BLAS is slow
PICTURES = 80  # at most, until a shader is compiled: without a graphics card that takes long
ADDON = "bl_ext.user_default.nfm.nfm_addon"


def addon(name):
    return import_module(f"{ADDON}.{name}")


def queue():
    return addon("fitting.queue").queue


def material(name="Cube"):
    return bpy.data.objects[name].active_material


def inputs():
    return addon("node_group").find_group_node(material()).inputs


# ---- the scene ----


def prepare(window):
    """A sphere in place of the cube's shape, and another one beside it.

    The Material tab is opened for pictures only: it shows a preview of the material by EEVEE, and
    without a graphics card the interface stands still until its shaders are compiled.
    """
    bpy.context.preferences.view.show_splash = False
    cube = bpy.data.objects["Cube"]
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, scale=(1.6, 1.6, 1.6))
    ball = bpy.context.active_object
    cube.data = ball.data
    cube.data.shade_smooth()
    cube.data.materials.clear()
    ball.name, ball.data = "Ball", cube.data.copy()
    ball.location = (0, 4, 0)
    ball.select_set(False)
    cube.select_set(True)
    bpy.context.view_layer.objects.active = cube
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo_push(message="Prepare")
    yield 0.5


def place_of(window, name):
    """Where an object is on the screen."""
    area = window.area("VIEW_3D")
    region = next(item for item in area.regions if item.type == "WINDOW")
    at = view3d_utils.location_3d_to_region_2d(
        region, area.spaces.active.region_3d, bpy.data.objects[name].location
    )
    return region.x + at.x, region.y + at.y


# ---- importing ----


def open_browser(window, *names, picture=None, **options):
    """File > Import > Measured BRDF, and files chosen in the browser."""
    with window.override(window.area("VIEW_3D")):
        bpy.ops.nfm.import_measurement("INVOKE_DEFAULT", **options)
    yield from window.until("the file browser is open", lambda: window.area("FILE_BROWSER"))
    browser = window.area("FILE_BROWSER")
    parameters = browser.spaces.active.params
    parameters.directory, parameters.filename = str(FOLDER).encode(), names[0]
    yield 0.5
    if picture:
        yield from save_operator_preset(window, browser)
        yield from window.picture(picture)
    window.move(browser.x + browser.width / 2, browser.y + browser.height / 2)
    yield 0.3
    window.key("RET")


def save_operator_preset(window, browser):
    """What the button + beside Operator Presets does."""
    operator = browser.spaces.active.active_operator
    operator.sampling = "SMOOTH"
    preset = {"name": "Smooth", "operator": operator.bl_idname}
    with window.override(browser):
        bpy.ops.wm.operator_preset_add(**preset)
    (path,) = Path(bpy.utils.user_resource("SCRIPTS")).rglob("Smooth.py")
    assert "op.sampling = 'SMOOTH'" in path.read_text(encoding="utf-8")
    operator.sampling = "NATIVE"
    yield 0.3


def import_and_watch(window):
    yield from open_browser(window, "first.binary", picture="browser")
    yield from window.until("the fit runs", lambda: queue().jobs)
    yield from window.until("it makes progress", lambda: queue().jobs[0].progress > 0.05)
    yield from window.picture("progress")
    yield from window.until("the draft is there", lambda: material() is not None)
    yield from window.until("the fit is there", lambda: not queue().jobs)
    assert material().nfm.quality == "standard"
    assert material().nfm.studio_psnr > 30
    yield from window.picture("imported")


def cancel_with_escape(window):
    before = set(bpy.data.materials.keys())
    kept = material()
    # the best quality takes so long that there is time to cancel it, however slow the window
    yield from open_browser(window, "second.binary", quality="BEST")
    yield from window.until("the second draft is there", lambda: material() != kept)
    assert material().nfm.quality == "draft"
    window.key("ESC")
    yield from window.until("nothing runs", lambda: not queue().jobs)
    yield 0.5
    assert set(bpy.data.materials.keys()) == before
    assert material() == kept


def undo_the_import(window):
    """Past the cancelled import and its cancelling, and back."""
    happened = []

    def count(*_arguments):
        happened.append(True)

    bpy.app.handlers.undo_post.append(count)
    bpy.app.handlers.redo_post.append(count)
    view = window.area("VIEW_3D")
    window.move(view.x + view.width / 2, view.y + view.height / 2)
    while bpy.data.materials.get("first"):
        before = len(happened)
        window.key("Z", ctrl=True)
        yield from window.until("a step is undone", lambda n=before: len(happened) > n)
    assert material() is None
    before = len(happened)
    window.key("Z", ctrl=True, shift=True)
    yield from window.until("a step is redone", lambda: len(happened) > before)
    assert material().name == "first"
    assert material().nfm.quality == "standard"


def drop_files(window):
    """From another program: onto the object that is not selected, then onto the shader editor."""
    if not window.takes_drops:
        print("session: drops are tried on X11 only", flush=True)
        return
    kept = material()
    bpy.context.preferences.addons[ADDON.rpartition(".")[0]].preferences.quality = "DRAFT"
    view = window.area("VIEW_3D")
    assert not bpy.data.objects["Ball"].select_get()
    yield from window.drop(*place_of(window, "Ball"), FOLDER / "third.nfm.json")
    yield from window.until("the ball has the material", lambda: material("Ball"))
    assert material("Ball").name == "third"
    assert material() == kept
    # two files at once where there is no object are for what is selected
    corner = view.x + 0.9 * view.width, view.y + 0.1 * view.height
    yield from window.drop(*corner, FOLDER / "third.nfm.json", FOLDER / "second.binary")
    yield from window.until("the first of two is there", lambda: material() != kept)
    assert material().name == "third.001"
    assert material("Ball").name == "third"
    yield from window.until("the second one is fitted", lambda: not queue().jobs)
    assert bpy.data.materials["second"].use_fake_user
    assert bpy.data.materials["second"].nfm.quality == "draft"  # as preferred
    view.ui_type = "ShaderNodeTree"
    yield 1.0
    yield from window.drop(
        view.x + view.width / 3, view.y + view.height / 3, FOLDER / "third.nfm.json"
    )
    yield from window.until("it is there again", lambda: material().name == "third.002")
    view.ui_type = "VIEW_3D"
    yield 0.5
    bpy.data.objects["Cube"].active_material = kept


# ---- editing ----


def look_at_the_panel(window):
    """In the large area; a gain dragged with the mouse, then undone."""
    area = window.area("VIEW_3D")
    area.type = "PROPERTIES"
    yield 0.5
    area.spaces.active.context = "MATERIAL"
    bpy.context.window_manager.nfm_plot.kind = "SLICES"
    yield 1.0
    outliner = window.area("OUTLINER")
    window.move(outliner.x + 9, outliner.y + 9)  # no tooltip over the panel
    yield from window.picture("panel")
    x, y = yield from window.button(area, "lobe_1.gain")
    lobe = material().nfm.edit.lobe_1
    assert lobe.gain == 1
    yield from window.drag((x, y), (x - 150, y))
    yield from window.until("the slider has followed the mouse", lambda: lobe.gain < 0.9)
    window.move(outliner.x + 9, outliner.y + 9)
    yield from window.picture("curves")
    window.move(x, y)
    window.key("Z", ctrl=True)
    yield from window.until(
        "the slider is back", lambda: material().nfm.edit.lobe_1.gain == 1, pause=0.5
    )
    area.type = "VIEW_3D"
    yield 1.0


def edit_and_undo(window):
    """Dim a lobe as its colour field would, take it back, mute a lobe."""
    scale = inputs()["Lobe 2 Scale"]
    scale.default_value = (0.2, 0.2, 0.2, 1)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.ed.undo_push(message="Dim")
    yield 0.5
    view = window.area("VIEW_3D")
    window.move(view.x + view.width / 2, view.y + view.height / 2)
    window.key("Z", ctrl=True)
    yield from window.until(
        "the scale is back", lambda: inputs()["Lobe 2 Scale"].default_value[0] == 1
    )
    assert material().nfm.quality == "standard"
    item = material()
    item.nfm.mute[0] = True
    yield 0.5
    assert "NFM Mute 1" in inputs().id_data.nodes["NFM BRDF"].node_tree.nodes
    item.nfm.mute[0] = False


# ---- what is seen ----


def look_at_nodes(window):
    """The shader editor with its sidebar, outside and inside the group."""
    area = window.area("VIEW_3D")
    area.ui_type = "ShaderNodeTree"
    yield 1.0
    area.spaces.active.show_region_ui = True
    yield 0.5
    for region in area.regions:
        if region.type == "UI":
            region.active_panel_category = "Measured BRDF"
    material().nfm.edit.lobe_1.width = 2.0
    bpy.context.window_manager.nfm_plot.kind = "NDF"
    tree = material().node_tree
    for node in tree.nodes:
        node.select = False
    with window.override(area):
        bpy.ops.node.view_all()
    yield from window.picture("nodes")
    node = addon("node_group").find_group_node(material())
    area.spaces.active.path.append(node.node_tree, node=node)
    yield 0.5
    with window.override(area):
        bpy.ops.node.view_all()
    yield from window.picture("group")
    area.spaces.active.path.pop()
    material().nfm.edit.lobe_1.width = 1.0
    area.spaces.active.show_region_ui = False
    area.ui_type = "VIEW_3D"
    yield 1.0


def look_at_the_viewport(window):
    """Solid with material colours, Material Preview and EEVEE: never black, never pink.

    Beside it there is a sphere without a material.
    """
    assert material("Ball") is None
    space = window.area("VIEW_3D").spaces.active
    space.overlay.show_overlays = False
    space.shading.color_type = "MATERIAL"
    for kind in ("SOLID", "MATERIAL", "RENDERED"):
        space.shading.type = kind
        yield from _until_drawn(window, kind.lower())
    space.shading.type = "SOLID"
    space.overlay.show_overlays = True


def _until_drawn(window, name):
    """Take pictures until the sphere looks like its material.

    While shaders compile, EEVEE shows nothing at first, then both spheres alike.
    """
    for _ in range(PICTURES):
        path = yield from window.picture(name)
        seen, plain = (window.pixels(path, *place_of(window, n), 60) for n in ("Cube", "Ball"))
        if plain.std(0).max() > 0.005 and abs(seen.mean(0) - plain.mean(0)).max() > 0.05:
            break
    else:
        raise AssertionError(f"the material is not seen in {name}")
    red, green, blue = mean = seen.mean(0)
    print(f"session: mean colour {mean.round(3)}", flush=True)
    assert mean.max() > 0.03, "black"
    assert not (red > 0.5 and blue > 0.5 and green < 0.3), "pink"


def look_at_preferences(window):
    area = window.area("VIEW_3D")
    area.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "NFM"
    with window.override(area):
        bpy.ops.preferences.addon_expand(module=ADDON.rpartition(".")[0])
    yield from window.picture("preferences")
    bpy.context.window_manager.addon_search = ""
    area.type = "VIEW_3D"
    yield 0.5


def look_at_assets(window):
    with window.override(window.area("VIEW_3D")):
        bpy.ops.nfm.import_measurement(
            filepath=str(FOLDER / "third.nfm.json"), assign=False, as_asset=True
        )
    area = window.area("VIEW_3D")
    area.ui_type = "ASSETS"
    yield 1.0
    parameters = area.spaces.active.params
    parameters.asset_library_reference = "LOCAL"
    yield from window.picture("assets")
    area.ui_type = "VIEW_3D"
    yield 0.5


def import_what_is_fitted(window):
    """A draft is there at once; what takes seconds is done beside the interface."""
    kept = material()
    area = window.area("VIEW_3D")
    before = time.thread_time()
    with window.override(area):
        bpy.ops.nfm.import_measurement(filepath=str(FOLDER / "fourth.nfm.json"))
    held = time.thread_time() - before
    print(f"session: importing held the interface for {held:.2f} CPU s", flush=True)
    assert held < HELD
    assert material() != kept
    assert material().nfm.native_psnr == 0
    yield from window.until("its base lobes are found", lambda: material().nfm.native_psnr)
    area.type = "PROPERTIES"
    yield 0.5
    area.spaces.active.context = "MATERIAL"
    yield from window.picture("fitted")
    area.type = "VIEW_3D"
    yield 0.5
    bpy.data.objects["Cube"].active_material = kept


# ---- files ----


def save_and_reopen(window):
    before = material().nfm.parameters
    path = str(FOLDER / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    yield from window.until("the file is open", lambda: bpy.data.filepath == path)
    yield 1.0
    assert material().nfm.parameters == before
    assert material().node_tree.get_output_node("EEVEE").inputs["Surface"].is_linked


def link_and_override(window):
    """The saved material in another file: linked, and made editable there."""
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.0
    with bpy.data.libraries.load(str(FOLDER / "saved.blend"), link=True) as (_, wanted):
        wanted.materials = ["first"]
    cube = bpy.data.objects["Cube"]
    cube.active_material = bpy.data.materials["first"]
    area = window.area("VIEW_3D")
    area.type = "PROPERTIES"
    area.spaces.active.context = "MATERIAL"
    yield from window.picture("linked")
    with window.override(area):
        bpy.ops.nfm.make_editable()
    yield from window.until("it is an override", lambda: material().override_library)
    yield from window.picture("override")
    area.type = "VIEW_3D"
    yield 0.5


def session(window):
    for step in (
        prepare,
        import_and_watch,
        look_at_the_panel,
        cancel_with_escape,
        edit_and_undo,
        undo_the_import,
        look_at_the_viewport,
        drop_files,
        look_at_nodes,
        look_at_preferences,
        look_at_assets,
        import_what_is_fitted,
        save_and_reopen,
        link_and_override,
    ):
        print(f"session: -- {step.__name__}", flush=True)
        yield from step(window)


run(session, Window(FOLDER))
