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


def test_there_is_no_object_below_the_mouse_in_a_shader_editor(addon):
    context = area("NODE_EDITOR", "ShaderNodeTree")
    assert addon("drop").object_under_mouse(context, None) is None
