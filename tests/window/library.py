# SPDX-License-Identifier: GPL-3.0-or-later
"""Asset libraries in a real window: a folder of measured files imported as one, and the material
library installed with one click and dropped onto an object.

As session.py: blender --python library.py -- FOLDER, with the add-on installed and enabled.
"""

import shutil
import sys
from importlib import import_module
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from driver import Window, run

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
LIBRARY = import_module("bl_ext.user_default.nfm.nfm_addon.material_library")


def cube():
    return bpy.data.objects["Cube"]


def import_folder(window):
    """File > Import > Folder of Measured BRDFs, before there is an asset browser."""
    folder = FOLDER / "measured"
    folder.mkdir()
    for name in ("first.binary", "second.binary"):
        shutil.copy(FOLDER / name, folder)
    with window.override(window.area("VIEW_3D")):
        bpy.ops.nfm.import_folder("INVOKE_DEFAULT", quality="DRAFT")
    yield from window.until("the file browser is open", lambda: window.area("FILE_BROWSER"))
    browser = window.area("FILE_BROWSER")
    browser.spaces.active.params.directory = str(folder).encode()
    yield 0.5
    window.move(browser.x + browser.width / 2, browser.y + browser.height / 2)
    yield 0.3
    window.key("RET")
    jobs = import_module("bl_ext.user_default.nfm.nfm_addon.fitting.queue").queue
    yield from window.until("the fits run", lambda: jobs.jobs)
    yield from window.picture("folder")
    yield from window.until("all is fitted", lambda: not jobs.jobs)
    output = Path(bpy.context.preferences.filepaths.asset_libraries["measured"].path)
    assert sorted(path.name for path in output.glob("*.blend")) == ["first.blend", "second.blend"]
    assert "2 fitted" in bpy.data.texts["Folder measured"].as_string()


def prepare(window):
    """A ball, and an asset browser in place of the timeline, made large."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1.6)
    ball = bpy.context.active_object
    cube().data = ball.data
    bpy.data.objects.remove(ball)
    cube().data.shade_smooth()
    cube().data.materials.clear()
    view = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window, area=view, region=view.regions[-1]):
        bpy.ops.screen.area_split(direction="HORIZONTAL", factor=0.62)
    yield 0.5
    views = [area for area in window.window.screen.areas if area.type == "VIEW_3D"]
    low = min(views, key=lambda area: area.y)
    low.ui_type = "ASSETS"
    top = window.area("VIEW_3D")
    top.spaces.active.shading.type = "MATERIAL"
    yield 1


def install(window):
    assert LIBRARY.registered() is None
    view = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window, area=view, region=view.regions[-1]):
        bpy.ops.nfm.install_library("INVOKE_DEFAULT")
    folder = LIBRARY.installed_folder()
    for number in (10, 20, 30):  # each within the patience of a window
        yield from window.until(
            f"{number} materials are made", lambda n=number: len(list(folder.glob("*.blend"))) >= n
        )
    yield from window.until("the library is installed", LIBRARY.registered, pause=0.5)


def browse(window):
    """The whole library, with its catalogues."""
    area = window.area("FILE_BROWSER")
    parameters = area.spaces.active.params
    parameters.asset_library_reference = LIBRARY.NAME
    yield 3
    with bpy.context.temp_override(window=window.window, area=area):
        bpy.ops.asset.library_refresh()
        yield 5
    yield from window.picture("library")


def drop(window):
    """Drag the first asset onto the ball."""
    area, view = window.area("FILE_BROWSER"), window.area("VIEW_3D")
    (main,) = (region for region in area.regions if region.type == "WINDOW")
    asset = (main.x + 60, main.y + main.height - 60)
    yield from window.drag(asset, (view.x + view.width / 2, view.y + view.height / 2))
    yield from window.until("a material is on the ball", lambda: cube().active_material)
    material = cube().active_material
    assert material.nfm.parameters
    assert not material.library
    assert material.asset_data is None or material.asset_data.catalog_id
    yield from window.picture("dropped")


def session(window):
    yield from import_folder(window)
    yield from prepare(window)
    yield from install(window)
    yield from browse(window)
    yield from drop(window)


run(session, Window(FOLDER))
