# SPDX-License-Identifier: GPL-3.0-or-later
"""Copy a curve or a whole lobe of one measured material, and paste it into another.

What is copied waits in the window manager as text: it is not saved, and no undo takes it back.
"""

from __future__ import annotations

import json
from dataclasses import asdict

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy.utils import register_classes_factory

from ...fitter.curves import FRESNEL_CURVES, MASKING_CURVES, NDF_CURVES
from ...fitter.edits import LobeSliders
from ...fitter.factors import N_LOBES
from .. import curve_nodes, editing
from ..edit_properties import LOBES, set_lobe_sliders, sliders_of
from ..errors import ShaderError
from .measured_material import EditOperator
from .reset_edits import SHAPES

CURVE_ITEMS = (*((name, name, "") for name in SHAPES), ("F", "F", "All four colour curves"))


def _curve_property() -> object:
    return EnumProperty(name="Curve", description="Which curve", items=CURVE_ITEMS)


def _lobe_property() -> object:
    return IntProperty(
        name="Lobe", description="Which lobe, narrow to wide", default=1, min=1, max=N_LOBES
    )


def _kind_and_names(curve: str) -> tuple[str, tuple[str, ...]]:
    """D, G or F, and the names of the curves that go together."""
    return (curve[-1], FRESNEL_CURVES if curve == "F" else (curve,))


def _lobe_curves(lobe: int) -> tuple[str, str]:
    return NDF_CURVES[lobe - 1], MASKING_CURVES[lobe - 1]


class _Copy(EditOperator):
    """Copies; nothing to undo and nothing to bring up to date."""

    bl_options = {"REGISTER"}

    def _handles(self, material: bpy.types.Material, names: tuple[str, ...]) -> list:
        found = curve_nodes.handles(editing.group_of(material))
        missing = [name for name in names if name not in found]
        if missing:
            message = rpt_("material {!r} has no curve {:s}; reset it first, if it is isotropic")
            raise ShaderError(message.format(material.name, missing[0]))
        return [found[name] for name in names]

    def _store(self, context: bpy.types.Context, content: dict) -> None:
        context.window_manager.nfm_clipboard = json.dumps(content)


class _Paste(EditOperator):
    """Pastes what there is, if it is of the right kind."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.window_manager.nfm_clipboard:
            cls.poll_message_set("Nothing was copied yet")
            return False
        return super().poll(context)

    def _content(self, context: bpy.types.Context, kind: str) -> dict:
        content = json.loads(context.window_manager.nfm_clipboard)
        if content["kind"] != kind:
            raise ShaderError(
                rpt_("copied was {:s}, expected {:s}; copy that first").format(
                    content["kind"], kind
                )
            )
        return content

    def _write(self, material: bpy.types.Material, names: tuple[str, ...], content: dict) -> None:
        curve_nodes.write(
            editing.own_group(material), dict(zip(names, content["handles"], strict=True))
        )


class NFM_OT_copy_curve(_Copy, bpy.types.Operator):
    """bpy.ops.nfm.copy_curve(curve='Lobe 1 D')."""

    bl_idname = "nfm.copy_curve"
    bl_label = "Copy Curve"
    bl_description = "Copy a curve as it is now, to paste it into another lobe or material"

    curve: _curve_property()

    def change(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        kind, names = _kind_and_names(self.curve)
        self._store(context, {"kind": kind, "handles": self._handles(material, names)})


class NFM_OT_paste_curve(_Paste, bpy.types.Operator):
    """bpy.ops.nfm.paste_curve(curve='Lobe 1 D')."""

    bl_idname = "nfm.paste_curve"
    bl_label = "Paste Curve"
    bl_description = "Give a curve the shape of the one that was copied"

    curve: _curve_property()

    def change(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        kind, names = _kind_and_names(self.curve)
        self._write(material, names, self._content(context, kind))


class NFM_OT_copy_lobe(_Copy, bpy.types.Operator):
    """bpy.ops.nfm.copy_lobe(lobe=1)."""

    bl_idname = "nfm.copy_lobe"
    bl_label = "Copy Lobe"
    bl_description = "Copy the curves and sliders of a lobe, to paste them into another"

    lobe: _lobe_property()

    def change(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        sliders = sliders_of(material.nfm.edit).lobes[self.lobe - 1]
        self._store(
            context,
            {
                "kind": "lobe",
                "handles": self._handles(material, _lobe_curves(self.lobe)),
                "sliders": asdict(sliders),
            },
        )


class NFM_OT_paste_lobe(_Paste, bpy.types.Operator):
    """bpy.ops.nfm.paste_lobe(lobe=1)."""

    bl_idname = "nfm.paste_lobe"
    bl_label = "Paste Lobe"
    bl_description = "Give a lobe the curves and sliders of the one that was copied"

    lobe: _lobe_property()

    def change(self, context: bpy.types.Context, material: bpy.types.Material) -> None:
        content = self._content(context, "lobe")
        self._write(material, _lobe_curves(self.lobe), content)
        sliders = getattr(material.nfm.edit, LOBES[self.lobe - 1])
        set_lobe_sliders(sliders, LobeSliders(**content["sliders"]))


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
