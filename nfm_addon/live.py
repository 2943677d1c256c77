# SPDX-License-Identifier: GPL-3.0-or-later
"""When shaders are brought up to date: soon after an edit, and before a render or a save.

Nothing is done while something else changes: Blender says which kinds of data were updated, and
only node trees and materials are looked at. Of a curve that is dragged by mouse it says nothing
before the button is released; but the editor with the curve is drawn anew, which is when its
material is looked at. What needs doing is always found by comparing states
(editing/state.py), never remembered, so undo, redo and loading a file need no care of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import bpy
from bpy.app.handlers import persistent

from ..fitter.errors import NfmError
from . import background_shading, changes, editing

# Updates come at the rate of the mouse; those of this many seconds become one shader.
PAUSE = 0.03
# Rest after which the draft that a drag leaves is replaced.
REST = 0.6

# How often to ask for base lobes that another process finds.
PATIENCE = 0.1

SettingsOf = Callable[[bpy.types.Material], bpy.types.PropertyGroup]


class _Timer:
    """Calls `_tick`: once soon after any number of requests, and again when all rests."""

    soon = False

    @classmethod
    def start(cls, seconds: float, *, soon: bool) -> None:
        registered = bpy.app.timers.is_registered(_tick)
        # one that is about to be called is not put off, or a drag would never be shown
        if bpy.app.background or (registered and cls.soon):
            return
        if registered:
            bpy.app.timers.unregister(_tick)
        cls.soon = soon
        bpy.app.timers.register(_tick, first_interval=seconds, persistent=True)

    @classmethod
    def stop(cls) -> None:
        if bpy.app.timers.is_registered(_tick):
            bpy.app.timers.unregister(_tick)


def request() -> None:
    """See to it that shaders are brought up to date: soon in a window, else by a render."""
    _Timer.start(PAUSE, soon=True)


def show(item: bpy.types.Material) -> None:
    """Make a shader what its material asks for, now; in a window a draft does if it takes seconds.

    Raises
    ------
    ParameterFileError, ShaderError
        As editing.refresh.
    """
    is_slow = not bpy.app.background and editing.slow_model(item) is not None
    editing.refresh(item, draft=is_slow)
    request()


def flush(settings_of: SettingsOf | None = None) -> list[bpy.types.Material]:
    """Bring every shader up to date, as for a render; the materials that had something to do.

    settings_of : gives the settings of a material in a frame; None is its own
    """
    _separate_copies()
    return [item for item in _editable() if _refresh(item, settings_of and settings_of(item))]


def _tick() -> float | None:
    """Timer: drafts of what was edited at once; when all rests, one finished shader at a time."""
    if bpy.app.is_job_running("RENDER"):  # which sets shaders to the values of its own frame
        return REST
    _Timer.soon = False
    _separate_copies()
    drafts = [item for item in _editable() if _refresh(item, draft=True)]
    if drafts:
        return REST
    for item in _editable():
        if _is_waiting(item):
            return PATIENCE
        if _refresh(item):
            return 0.0
    background_shading.stop()
    return None


def _is_waiting(item: bpy.types.Material) -> bool:
    try:
        slow = editing.slow_model(item)
    except NfmError:
        return False  # _refresh meets it too
    return slow is not None and not background_shading.is_over(slow)


def _refresh(
    item: bpy.types.Material,
    settings: bpy.types.PropertyGroup | None = None,
    *,
    draft: bool = False,
) -> bool:
    try:
        return editing.refresh(item, settings, draft=draft)
    except NfmError as error:
        # no operator to report it; and what cannot be made now, will not be by trying again
        editing.give_up(item, settings)
        print(f"nfm: {error}")  # noqa: T201
        return False


def _separate_copies() -> None:
    """A copied material gets a node group of its own, before its curves can be dragged."""
    seen = set()
    for item in _editable():
        group = editing.group_of(item)
        if group in seen:
            editing.own_group(item)
        seen.add(group)


def _editable() -> Iterator[bpy.types.Material]:
    return filter(editing.has_own_nodes, editing.measured_materials())


def _on_edit(_material: bpy.types.Material) -> None:
    request()


@persistent
def _on_update(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not (depsgraph.id_type_updated("NODETREE") or depsgraph.id_type_updated("MATERIAL")):
        return
    updated = {
        update.id.original
        for update in depsgraph.updates
        if isinstance(update.id, (bpy.types.Material, bpy.types.NodeTree))
    }
    seen = set()
    for item in _editable():
        group = editing.group_of(item)
        changed = (item in updated or group in updated) and not editing.is_drafted(item)
        if changed or group in seen:
            request()
            return
        seen.add(group)


def _on_draw() -> None:
    """See whether a curve of the material that an editor shows is being dragged."""
    item = _shown_material(bpy.context)
    if item and editing.has_own_nodes(item) and not editing.is_drafted(item):
        request()


def _shown_material(context: bpy.types.Context) -> bpy.types.Material | None:
    """The measured material that a properties or node editor shows."""
    item = getattr(context, "material", None) or getattr(context.space_data, "id", None)
    return item if isinstance(item, bpy.types.Material) and item.nfm.parameters else None


@persistent
def _on_history(*_arguments: object) -> None:
    request()


@persistent
def _on_render(*_arguments: object) -> None:
    flush()


@persistent
def _on_save(*_arguments: object) -> None:
    # The file may be rendered where there is no add-on to finish a draft. Copies stay together as
    # long as nothing tells them apart.
    if not bpy.app.is_job_running("RENDER"):
        for item in _editable():
            _refresh(item)


@persistent
def _on_frame(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Sliders may be animated: their values are those of the evaluated material."""
    rendering = depsgraph.mode == "RENDER"
    for item in _editable():
        if item.animation_data:
            settings = item.evaluated_get(depsgraph).nfm
            if _refresh(item, settings, draft=not rendering):
                _animate_again(item)
                if not rendering:
                    _Timer.start(REST, soon=False)


def _animate_again(item: bpy.types.Material) -> None:
    """Have Blender evaluate other animation of a material anew.

    What a handler changes is copied into the render from the originals, whose keyframed values are
    not those of the frame.
    """
    for animated in (item, item.node_tree, editing.group_of(item)):
        if animated.animation_data:
            animated.update_tag(refresh={"TIME"})


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "undo_post": _on_history,
    "redo_post": _on_history,
    "load_post": _on_history,
    "render_init": _on_render,
    "save_pre": _on_save,
    "render_complete": _on_history,
    "render_cancel": _on_history,
    "frame_change_post": _on_frame,
}


# Editors and regions with curves: the panel, the nodes themselves, and the panel beside them.
_DRAWN = (
    (bpy.types.SpaceProperties, "WINDOW"),
    (bpy.types.SpaceNodeEditor, "WINDOW"),
    (bpy.types.SpaceNodeEditor, "UI"),
)
_draw_handlers: list[tuple[type, str, object]] = []


def register() -> None:
    for space, region in _DRAWN:
        handler = space.draw_handler_add(_on_draw, (), region, "POST_PIXEL")
        _draw_handlers.append((space, region, handler))
    changes.edits.listen(_on_edit)
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for space, region, handler in _draw_handlers:
        space.draw_handler_remove(handler, region)
    _draw_handlers.clear()
    changes.edits.forget(_on_edit)
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    _Timer.stop()
