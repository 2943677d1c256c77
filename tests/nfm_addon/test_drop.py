# SPDX-License-Identifier: GPL-3.0-or-later
"""Drag and drop, as far as it goes without a window."""

from types import SimpleNamespace

import pytest


def area(kind, tree_type=None):
    spaces = SimpleNamespace(active=SimpleNamespace(tree_type=tree_type))
    return SimpleNamespace(area=SimpleNamespace(type=kind, spaces=spaces))


@pytest.mark.parametrize(
    ("context", "takes"),
    [
        (area("VIEW_3D"), True),
        (area("NODE_EDITOR", "ShaderNodeTree"), True),
        (area("NODE_EDITOR", "GeometryNodeTree"), False),
        (area("IMAGE_EDITOR"), False),
        (SimpleNamespace(area=None), False),
    ],
)
def test_where_files_may_be_dropped(context, takes, blender):
    assert blender.types.NFM_FH_measured_brdf.poll_drop(context) is takes


def test_files_of_every_format_are_taken(blender):
    handler = blender.types.NFM_FH_measured_brdf
    assert handler.bl_import_operator == "nfm.import_measurement"
    wanted = {".binary", ".bsdf", ".bin", ".exr", ".json"}
    assert set(handler.bl_file_extensions.split(";")) == wanted


def test_a_drop_on_a_shader_editor_is_for_the_object_whose_material_it_shows(
    addon, blender, mesh_object
):
    shown, active = blender.data.objects.new("Shown", None), mesh_object()
    target = addon("drop").target
    context = area("NODE_EDITOR", "ShaderNodeTree")
    context.active_object = active
    context.area.spaces.active.id_from = shown
    assert target(context, None) == shown
    context.area.spaces.active.id_from = blender.context.scene.world
    assert target(context, None) == active
    assert target(SimpleNamespace(area=None), None) is None


def test_on_a_header_there_is_no_object_below_the_mouse(addon):
    context = area("VIEW_3D")
    context.region, context.region_data = SimpleNamespace(x=0, y=0), None
    assert addon("drop").target(context, None) is None


@pytest.mark.parametrize(
    ("mouse", "name"), [((150, 80), "Thing"), ((150, 20), None), ((110, 80), "Left")]
)
def test_the_object_below_the_mouse_is_found(mouse, name, addon, blender, mesh_object):
    """Seen from above, orthographic, 10 units across 100 pixels; `tests/window` asks Blender."""
    from mathutils import Matrix

    for where, item in (((0, 0, 0), mesh_object()), ((-4, 0, 0), mesh_object())):
        corners = [(x, y, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        item.data.from_pydata(corners, [], [(0, 1, 2, 3)])
        item.location = where
    item.name = "Left"
    blender.context.view_layer.update()
    matrix = Matrix.Diagonal((0.2, 0.2, -0.01, 1))  # of a view from above
    view = SimpleNamespace(
        is_perspective=False,
        perspective_matrix=matrix,
        view_matrix=Matrix.Translation((0, 0, -10)),
        clip_end=100,
        view_perspective="ORTHO",
    )
    context = area("VIEW_3D")
    context.region = SimpleNamespace(x=100, y=30, width=100, height=100)
    context.region_data, context.scene = view, blender.context.scene
    context.evaluated_depsgraph_get = blender.context.evaluated_depsgraph_get
    event = SimpleNamespace(mouse_x=mouse[0], mouse_y=mouse[1])
    found = addon("drop").target(context, event)
    assert (found and found.name) == name
