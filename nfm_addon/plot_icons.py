# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots as icons, which is how a panel can show pixels; drawn anew only for another model."""

from __future__ import annotations

import bpy
import bpy.utils.previews
import numpy as np
from bpy.props import EnumProperty, FloatProperty, PointerProperty
from bpy.utils import register_classes_factory

from ..fitter.stand_in import without_direction
from . import material as materials
from .plot import PLOTS
from .slices_text import decode

KIND_ITEMS = (
    (
        "NDF",
        "D",
        "Distribution of the facets of each lobe: theta_h from 0 to 90 degrees on a "
        "square-root axis, 4 decades",
    ),
    ("FRESNEL", "F", "Fresnel curves of red, green and blue: theta_d from 0 to 90 degrees, 0 to 1"),
    ("MASKING", "G", "Masking of each lobe: theta from 0 to 90 degrees, 0 to 1"),
    (
        "SLICES",
        "Slice",
        "Reflected light in the plane of incidence, light from 10, 30, 60 and 80 "
        "degrees: from -90 to 90 degrees, 4 decades; the measurement in grey where it is known",
    ),
)


class NFM_PG_plot(bpy.types.PropertyGroup):
    """What the plot of the panel shows: window_manager.nfm_plot."""

    kind: EnumProperty(name="Plot", description="What is plotted", items=KIND_ITEMS)
    size: FloatProperty(
        name="Size", description="Size of the plot", default=11, min=4, max=24, precision=1
    )


class PlotIcons:
    """The icon of each kind of plot, and what it was drawn from."""

    def __init__(self) -> None:
        self._previews = bpy.utils.previews.new()
        self._drawn: dict[str, tuple[str, str]] = {}

    def icon_of(self, item: bpy.types.Material, kind: str) -> int:
        """Icon of a material's plot.

        Raises
        ------
        ParameterFileError
            The material's parameters were damaged.
        """
        state = (item.nfm.parameters, item.nfm.slices)
        if self._drawn.get(kind) != state:
            model = without_direction(materials.fitted_material(item).model)
            pixels = PLOTS[kind](model, decode(item.nfm.slices))
            preview = self._previews.get(kind) or self._previews.new(kind)
            preview.image_size = preview.icon_size = pixels.shape[1::-1]
            preview.image_pixels_float.foreach_set(np.ravel(pixels))
            preview.icon_pixels_float.foreach_set(np.ravel(pixels))
            self._drawn[kind] = state
        return self._previews[kind].icon_id

    def close(self) -> None:
        """Free the pixels."""
        bpy.utils.previews.remove(self._previews)


icons: PlotIcons | None = None

_register_classes, _unregister_classes = register_classes_factory((NFM_PG_plot,))


def register() -> None:
    global icons
    _register_classes()
    bpy.types.WindowManager.nfm_plot = PointerProperty(type=NFM_PG_plot)
    icons = PlotIcons()


def unregister() -> None:
    global icons
    icons.close()
    icons = None
    del bpy.types.WindowManager.nfm_plot
    _unregister_classes()
