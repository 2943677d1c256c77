# SPDX-License-Identifier: GPL-3.0-or-later
"""Where fits land: in a new material on objects, or in a material that is there already.

A draft lands with an undo step of its own and is replaced without one, so that importing is one
step. Undo and redo can lead back to the draft; a handler then puts the finished fit in its place,
or removes it where the import was cancelled.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_rpt as rpt_

from ...fitter.shading.icon import material_icon
from ...fitter.shading.shading import takes_seconds
from ...osl import generate
from .. import assets, assignment, live, material, render_setup, slices_text, undo
from ..preferences import preferences_of
from .queue import FitResult

# Results of this session by the token of their import, for drafts that undo brings back.
_finished: dict[str, FitResult] = {}

# Cancelled imports of this session by their token, likewise.
_abandoned: dict[str, NewMaterial] = {}


@dataclass
class NewMaterial:
    """A new material, put on objects.

    path : the measured file
    sampling : an identifier of properties.SAMPLING_ITEMS
    targets : session_uid of objects
    as_asset : mark the material as an asset
    waits : whether base lobes that take seconds and that nobody knows are found at once, and not
        after it is shown
    """

    path: str
    sampling: str
    targets: list[int]
    as_asset: bool = False
    waits: bool = False
    wants_draft: bool = True
    output: None = None
    _token: str = field(default_factory=lambda: secrets.token_hex(8))
    _assignments: list[assignment.Assignment] = field(default_factory=list)
    _has_landed: bool = False

    @property
    def wants_shading(self) -> bool:
        """Whether its sampling has base lobes."""
        return _has_base(self.sampling)

    def draft(self, result: FitResult) -> None:
        """Make the material and assign it."""
        self._make(result)
        undo.push(rpt_("Import Measured BRDF"))

    def final(self, result: FitResult) -> str:
        """Replace the draft's model, or make the material if there was no draft."""
        if not self._has_landed:
            message = self._message(self._make(result))
            undo.push(rpt_("Import Measured BRDF"))
            return message
        _finished[self._token] = result
        landed = _with_token(self._token)
        for item in landed:
            _put(item, result, self.waits)
        if not landed:
            return rpt_("{:s}: its draft was removed, and so is the fit").format(result.fitted.name)
        return self._message(landed[0])

    @property
    def is_assigned(self) -> bool:
        """Whether an object has taken the material."""
        return bool(self._assignments)

    def fail(self, _message: str) -> str:
        """Remove the draft."""
        self.abandon()
        return "ERROR"

    def abandon(self) -> None:
        """Remove the draft, now and whenever undo brings it back."""
        _abandoned[self._token] = self
        if self.take_back():
            undo.push(rpt_("Cancel Import"))

    def take_back(self) -> bool:
        """Remove the draft and give objects their materials back; whether there was one."""
        landed = _with_token(self._token)
        for done in self._assignments:
            assignment.take_back(done, landed)
        for item in landed:
            material.remove(item)
        return bool(landed)

    def _make(self, result: FitResult) -> bpy.types.Material:
        draft = not self.waits and takes_seconds(result.fitted.model)
        new = material.build(result.fitted, self.sampling, draft=draft)
        live.request()
        self._has_landed = True
        new.nfm.token = self._token
        new.nfm.source_path = self.path
        _remember_slices(new, result)
        for uid in self.targets:
            if done := assignment.assign(uid, new):
                self._assignments.append(done)
        if not self._assignments:
            # without a user it would vanish when the file is saved
            new.use_fake_user = True
        if self.as_asset:
            icon = material_icon(result.fitted.model) if result.icon is None else result.icon
            assets.mark(new, icon)
        return new

    def _message(self, new: bpy.types.Material) -> str:
        """Where the material is, its error, and what was changed in the scene for it."""
        names = [item.name for done in self._assignments if (item := done.find_object())]
        if not self.targets:
            message = rpt_("{:s} is in the material list").format(new.name)
        elif not names:
            message = rpt_(
                "{:s}: no selected object takes materials; find it in the material list"
            ).format(new.name)
        else:
            message = rpt_("{:s} is on {:s}").format(new.name, ", ".join(names))
        if new.nfm.sampling == "NATIVE" and new.nfm.native_psnr:
            error = rpt_("; error of native sampling {:.2f} %")
            message += error.format(100 * new.nfm.native_error)
        if preferences_of(bpy.context).automatic_set_up:
            changes = render_setup.set_up(bpy.context)
            if changes:
                message += rpt_("; changed: {:s}").format("; ".join(changes))
        return message


@dataclass
class ExistingMaterial:
    """A material whose model is replaced; nothing changes before the fit is finished.

    There is no draft, which would put a worse model in the place of a good one.

    uid : its session_uid
    path : the measured file
    title : of the undo step
    waits : as in NewMaterial
    """

    uid: int
    path: str
    title: str
    waits: bool = False
    wants_draft: bool = False
    output: None = None

    @property
    def wants_shading(self) -> bool:
        """Whether its sampling has base lobes."""
        found = self._find()
        return found is not None and _has_base(found.nfm.sampling)

    def final(self, result: FitResult) -> str:
        """Replace the model."""
        found = self._find()
        if found is None:
            return rpt_("{:s}: its material was removed meanwhile").format(result.fitted.name)
        _put(found, result, self.waits)
        found.nfm.source_path = self.path
        undo.push(self.title)
        return rpt_("{:s} has the model of {:s}").format(found.name, result.fitted.name)

    def fail(self, _message: str) -> str:
        """Nothing was changed."""
        return "ERROR"

    def abandon(self) -> None:
        """Nothing was changed."""

    def _find(self) -> bpy.types.Material | None:
        return next((m for m in bpy.data.materials if m.session_uid == self.uid), None)


def _has_base(sampling: str) -> bool:
    return sampling.lower() in generate.BASE_SAMPLINGS


def _put(item: bpy.types.Material, result: FitResult, waits: bool = False) -> None:
    draft = not waits and takes_seconds(result.fitted.model)
    material.replace_model(item, result.fitted, draft=draft)
    live.request()
    _remember_slices(item, result)
    if item.asset_data and result.icon is not None:
        assets.set_icon(item, result.icon)


def _remember_slices(item: bpy.types.Material, result: FitResult) -> None:
    if result.slices is not None:
        item.nfm.slices = slices_text.encode(result.slices)


def _with_token(token: str) -> list[bpy.types.Material]:
    return [item for item in bpy.data.materials if item.nfm.token == token]


@persistent
def _finish_drafts(*_arguments: object) -> None:
    for place in [_abandoned[t] for m in bpy.data.materials if (t := m.nfm.token) in _abandoned]:
        place.take_back()
    for item in bpy.data.materials:
        result = _finished.get(item.nfm.token)
        if result and item.nfm.quality == "draft":
            _put(item, result)


@persistent
def _forget_results(*_arguments: object) -> None:
    _finished.clear()
    _abandoned.clear()


_HANDLERS = (
    ("undo_post", _finish_drafts),
    ("redo_post", _finish_drafts),
    ("load_pre", _forget_results),
)


def register() -> None:
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    _finished.clear()
    _abandoned.clear()
