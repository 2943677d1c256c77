# SPDX-License-Identifier: GPL-3.0-or-later
"""What decides how a material looks.

States are compared and no edit is remembered, so undo, redo, loading and copies need no
bookkeeping.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache

import bpy

from ...fitter.editing.edit_document import Handles
from ...fitter.editing.edits import Sliders
from ...fitter.formats import parameter_file
from ...fitter.formats.parameter_file import FittedMaterial
from ...fitter.models.factors import Factors
from .. import curve_nodes
from ..edit_properties import sliders_of
from .own_nodes import group_of


@dataclass(frozen=True)
class State:
    """What decides how a material looks.

    settings : material.nfm, or an evaluated copy with the values of a frame
    handles : of its curves
    """

    settings: bpy.types.PropertyGroup
    handles: Handles

    @property
    def measured(self) -> Factors:
        """The model as measured."""
        return _parsed(self.settings.parameters, f"material {self.settings.id_data.name!r}")

    @property
    def other(self) -> Factors:
        """The model that this one is blended with."""
        edit = self.settings.edit
        return _parsed(edit.blend_parameters, f"material {edit.blend_name!r}")

    @property
    def sliders(self) -> Sliders:
        """Neutral while the original is shown."""
        edit = self.settings.edit
        return Sliders() if edit.show_original else sliders_of(edit)

    @property
    def share(self) -> float:
        """How much there is of the material it is blended with."""
        edit = self.settings.edit
        return 0.0 if edit.show_original or not edit.blend_parameters else edit.blend

    @property
    def keep_energy(self) -> bool:
        """Whether the lobes are lowered to what light there is."""
        return self.settings.edit.keep_energy and not self.settings.edit.show_original

    def digest(self) -> str:
        """The same for states that need the same shader."""
        edit = self.settings.edit
        # what the shader has as inputs matters only where it takes part in the albedo
        sliders = self.sliders if self.keep_energy else self.sliders.for_model()
        parts = (
            self.settings.parameters,
            self.settings.sampling,
            repr(sliders),
            self.share and (self.share, edit.blend_parameters),
            self.keep_energy,
            edit.show_original or (edit.drawn, self.handles),
        )
        return hashlib.sha256(repr(parts).encode()).hexdigest()


def state_of(owner: bpy.types.Material, settings: bpy.types.PropertyGroup | None = None) -> State:
    """The state of a material, or with the settings of a frame.

    Raises
    ------
    ShaderError
        The material has lost its Script node.
    """
    return State(settings or owner.nfm, curve_nodes.handles(group_of(owner)))


def fitted_material(owner: bpy.types.Material) -> FittedMaterial:
    """The model that a material was made from, without edits.

    Raises
    ------
    ParameterFileError
        The material has none, or the stored text was damaged.
    """
    return parameter_file.loads(owner.nfm.parameters, f"material {owner.name!r}")


@lru_cache(maxsize=8)
def _parsed(parameters: str, name: str) -> Factors:
    """A stored model; while a person drags it is the same one again and again."""
    return parameter_file.loads(parameters, name).model
