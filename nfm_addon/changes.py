# SPDX-License-Identifier: GPL-3.0-or-later
"""Word of changed properties, from where they are defined to whoever acts on it.

Properties are defined before anything that acts on them and know nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..fitter.errors import NfmError

Listener = Callable[[bpy.types.Material], object]


class Change:
    """A kind of change of a material, and who wants to hear of it."""

    def __init__(self) -> None:
        self._listeners: list[Listener] = []

    def listen(self, listener: Listener) -> None:
        """Call the listener from now on."""
        self._listeners.append(listener)

    def forget(self, listener: Listener) -> None:
        """Call the listener no more."""
        self._listeners.remove(listener)

    def tell(self, material: bpy.types.Material) -> None:
        """Call the listeners; what they cannot do is printed, as there is nobody to report to."""
        for listener in self._listeners:
            try:
                listener(material)
            except NfmError as error:
                print(f"nfm: {error}")  # noqa: T201


# Of a slider, the blend or a choice in material.nfm.edit.
edits = Change()
# Of material.nfm.sampling.
sampling = Change()
# Of material.nfm.mute or solo.
audible = Change()
