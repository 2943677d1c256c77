# SPDX-License-Identifier: GPL-3.0-or-later
"""A curve is dragged by mouse while the viewport shows it: blender --python curves.py -- FOLDER.

FOLDER holds a measured file, first.binary, and gets the pictures. The add-on is installed and
enabled. The viewport is Cycles; in a Blender without OSL the stand-in follows the drag.
"""

import sys
from importlib import import_module
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from driver import Window, run

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])
ADDON = "bl_ext.user_default.nfm.nfm_addon"
CURVE = "Lobe 1 D"
HIGH = 0.85  # a handle below this is in the highlight, where most of the light is
# Where a curve is within its node, from its left and its top, as shares of its size.
LEFT, RIGHT, TOP, BOTTOM = 0.044, 0.969, 0.216, 0.865


def module(name):
    return import_module(f"{ADDON}.{name}")


def material():
    return bpy.data.objects["Cube"].active_material


def group():
    return module("editing").group_of(material())


def handles():
    return module("curve_nodes").handles(group())[CURVE]


def roughness():
    """Of the stand-in's lobe."""
    return group().nodes["NFM Stand-in Glossy 1"].inputs["Roughness"].default_value


def prepare(window):
    """A smooth sphere with a measured material."""
    bpy.context.preferences.view.smooth_view = 0
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, scale=(1.6, 1.6, 1.6))
    ball = bpy.context.active_object
    cube = bpy.data.objects["Cube"]
    cube.data = ball.data
    bpy.data.objects.remove(ball)
    cube.data.shade_smooth()
    cube.data.materials.clear()
    bpy.context.view_layer.objects.active = cube
    cube.select_set(True)
    with bpy.context.temp_override(window=window.window):
        bpy.ops.nfm.import_measurement(filepath=str(FOLDER / "first.binary"), quality="DRAFT")
    yield from window.until(
        "the fit is there", lambda: material() and not module("fitting.queue").queue.jobs
    )


def main_region(area):
    return next(region for region in area.regions if region.type == "WINDOW")


def lay_out(window):
    """Cycles on the left; on the right the inside of the material's node group."""
    area = window.area("VIEW_3D")
    with bpy.context.temp_override(window=window.window, area=area):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.35)
    yield 1.0
    areas = [area for area in window.window.screen.areas if area.type == "VIEW_3D"]
    view, editor = sorted(areas, key=lambda area: area.x)
    space = view.spaces.active
    space.show_gizmo = space.show_region_toolbar = space.overlay.show_overlays = False
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.preview_samples = 8
    scene.cycles.use_preview_denoising = True
    space.shading.type = "RENDERED"
    space.shading.use_scene_world_render = space.shading.use_scene_lights_render = False
    with bpy.context.temp_override(window=window.window, area=view, region=main_region(view)):
        bpy.ops.view3d.view_selected()
    editor.ui_type = "ShaderNodeTree"
    yield 1.0
    nodes = material().node_tree.nodes
    nodes.active = module("node_group").find_group_node(material())
    editor.spaces.active.path.append(group(), node=nodes.active)
    editor.spaces.active.show_region_ui = False
    for node in group().nodes:
        node.select = node.name == CURVE
    yield 1.0
    region = main_region(editor)
    with bpy.context.temp_override(window=window.window, area=editor, region=region):
        bpy.ops.node.view_selected()
    yield 2.0
    return region


def place_of(region, handle):
    """Where a handle is in the window."""
    node = group().nodes[CURVE]
    left, top = node.location_absolute
    width, height = node.dimensions
    x = left + width * (LEFT + (RIGHT - LEFT) * handle[0])
    y = top - height * (BOTTOM + (TOP - BOTTOM) * handle[1])
    inside = region.view2d.view_to_region(x, y, clip=False)
    return region.x + inside[0], region.y + inside[1]


def drag_a_handle(window, region):
    """Down and to the right; what is seen follows before the button is released."""
    before, shader, shape = handles(), group().nfm.applied, roughness()
    x, y = place_of(region, next(handle for handle in before if handle[1] < HIGH))
    window.move(x, y)
    yield 0.2
    window.event("LEFTMOUSE")
    yield 0.2
    shaders = {shader}
    for step in range(1, 13):
        window.move(x + step, y - 3 * step)
        yield 0.3
        shaders.add(group().nfm.applied)
    yield from window.until("the shader follows the drag", lambda: group().nfm.applied != shader)
    yield from window.until("the stand-in follows the drag", lambda: roughness() != shape)
    print(f"session: {len(shaders) - 1} shaders in 12 steps of the mouse", flush=True)
    assert len(shaders) > 2
    assert group().nfm.applied.endswith("draft")
    yield 20.0  # the picture gathers samples
    yield from window.picture("dragging")
    window.event("LEFTMOUSE", "RELEASE")
    yield from window.until(
        "the shader is finished", lambda: not group().nfm.applied.endswith("draft")
    )
    assert module("editing").is_drafted(material())
    moved = [new for old, new in zip(before, handles(), strict=True) if old != new]
    assert moved
    window.key("Z", ctrl=True)
    yield from window.until("the curve is back", lambda: handles() == before, pause=0.5)
    yield from window.until(
        "and its shader", lambda: group().nfm.applied == shader and roughness() == shape, pause=0.5
    )


def session(window):
    yield from prepare(window)
    region = yield from lay_out(window)
    yield from drag_a_handle(window, region)


run(session, Window(FOLDER))
