# SPDX-License-Identifier: GPL-3.0-or-later
"""Copy a curve or a whole lobe of one measured material, and paste it into another.

What is copied waits in the window manager as text: it is not saved, and no undo takes it back.
"""

from __future__ import annotations

import json

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy.utils import register_classes_factory

from ...fitter.models.factors import N_LOBES
from ..editing import parts
from ..editing.parts import Part
from .measured_material import EditOperator, MaterialOperator


class _OfCurve:
    """Concerns one curve, or the four of F."""

    curve: EnumProperty(
        name="Curve",
        description="Which curve; F are all four colour curves",
        items=[(name, name, "") for name in parts.CURVE_PARTS],
    )

    def part(self, _material: bpy.types.Material) -> Part:
        return parts.curve_part(self.curve)


class _OfLobe:
    """Concerns the curves and sliders of one lobe."""

    lobe: IntProperty(
        name="Lobe", description="Which lobe, narrow to wide", default=1, min=1, max=N_LOBES
    )

    def part(self, material: bpy.types.Material) -> Part:
        return parts.lobe_part(material, self.lobe - 1)


class _Copy(MaterialOperator):
    """Copies; nothing to undo."""

    bl_options = {"REGISTER"}

    def act(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        content = parts.copied(material, self.part(material))
        context.window_manager.nfm_clipboard = json.dumps(content)


class _Paste(EditOperator):
    """Pastes what there is, if it is of the right kind."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.window_manager.nfm_clipboard:
            cls.poll_message_set("Nothing was copied yet")
            return False
        return super().poll(context)

    def change(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        content = json.loads(context.window_manager.nfm_clipboard)
        parts.paste(material, self.part(material), content)


class NFM_OT_copy_curve(_OfCurve, _Copy, bpy.types.Operator):
    """bpy.ops.nfm.copy_curve(curve='Lobe 1 D')."""

    bl_idname = "nfm.copy_curve"
    bl_label = "Copy Curve"
    bl_description = "Copy a curve as it is now, to paste it into another lobe or material"


class NFM_OT_paste_curve(_OfCurve, _Paste, bpy.types.Operator):
    """bpy.ops.nfm.paste_curve(curve='Lobe 1 D')."""

    bl_idname = "nfm.paste_curve"
    bl_label = "Paste Curve"
    bl_description = "Give a curve the shape of the one that was copied"


class NFM_OT_copy_lobe(_OfLobe, _Copy, bpy.types.Operator):
    """bpy.ops.nfm.copy_lobe(lobe=1)."""

    bl_idname = "nfm.copy_lobe"
    bl_label = "Copy Lobe"
    bl_description = "Copy the curves and sliders of a lobe, to paste them into another"


class NFM_OT_paste_lobe(_OfLobe, _Paste, bpy.types.Operator):
    """bpy.ops.nfm.paste_lobe(lobe=1)."""

    bl_idname = "nfm.paste_lobe"
    bl_label = "Paste Lobe"
    bl_description = "Give a lobe the curves and sliders of the one that was copied"


_register_classes, _unregister_classes = register_classes_factory(
    (NFM_OT_copy_curve, NFM_OT_paste_curve, NFM_OT_copy_lobe, NFM_OT_paste_lobe)
)


def register() -> None:
    _register_classes()
    bpy.types.WindowManager.nfm_clipboard = StringProperty(
        name="NFM Clipboard",
        description="The curve or lobe that was copied last (JSON)",
        options={"HIDDEN", "SKIP_SAVE"},
    )


def unregister() -> None:
    del bpy.types.WindowManager.nfm_clipboard
    _unregister_classes()
