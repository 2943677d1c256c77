# SPDX-License-Identifier: GPL-3.0-or-later
"""Plots as icons, which is how a panel can show pixels; drawn anew only for another model.

A thick line is the material as edited; where that differs, a thin one is the fit.
"""

from __future__ import annotations

from dataclasses import fields

import bpy
import bpy.utils.previews
import numpy as np
from bpy.props import EnumProperty, FloatProperty, PointerProperty
from bpy.utils import register_classes_factory

from ..fitter.grading.slices import INCIDENCE
from ..fitter.models.model import FactorModel
from ..fitter.shading.stand_in import without_direction
from . import editing
from .edit_properties import sliders_of
from .plot import CHANNELS, LOBES, MEASURED, PLOTS, SLICES
from .slices_text import decode

_AS_FITTED = "Thin lines: as fitted, where it was edited"

KIND_ITEMS = (
    (
        "NDF",
        "D",
        "Distribution of the facets of each lobe: theta_h from 0 to 90 degrees on a "
        f"square-root axis, 4 decades. {_AS_FITTED}",
    ),
    (
        "FRESNEL",
        "F",
        "Fresnel curves of red, green and blue: theta_d from 0 to 90 degrees, 0 to 1. "
        f"{_AS_FITTED}",
    ),
    (
        "MASKING",
        "G",
        f"Masking of each lobe: theta from 0 to 90 degrees, 0 to 1. {_AS_FITTED}",
    ),
    (
        "SLICES",
        "Slice",
        "Reflected light in the plane of incidence, light from 10, 30, 60 and 80 "
        "degrees: from -90 to 90 degrees, 4 decades; the measurement in grey where it is known. "
        f"{_AS_FITTED}",
    ),
)

# Short enough for a sidebar.
CAPTIONS = {
    "NDF": "Facets at 0 to 90\N{DEGREE SIGN}, 4 decades",
    "FRESNEL": "Difference angle 0 to 90\N{DEGREE SIGN}",
    "MASKING": "Angle to the normal 0 to 90\N{DEGREE SIGN}",
    "SLICES": "View at -90 to 90\N{DEGREE SIGN}, 4 decades",
}

_LOBE_LEGEND = [(f"Lobe {lobe}", color) for lobe, color in enumerate(LOBES, 1)]

LEGENDS = {
    "NDF": _LOBE_LEGEND,
    "FRESNEL": list(zip(("Red", "Green", "Blue"), CHANNELS, strict=True)),
    "MASKING": _LOBE_LEGEND,
    "SLICES": [
        *zip((f"{a:.0f}\N{DEGREE SIGN}" for a in np.degrees(INCIDENCE)), SLICES, strict=True),
        ("Data", MEASURED),
    ],
}


class NFM_PG_plot(bpy.types.PropertyGroup):
    """What the plot of the panel shows: window_manager.nfm_plot."""

    kind: EnumProperty(name="Plot", description="What is plotted", items=KIND_ITEMS)
    size: FloatProperty(
        name="Size", description="Size of the plot", default=12, min=4, max=24, precision=1
    )


class PlotIcons:
    """The icon of each kind of plot, and what it was drawn from; squares of one colour."""

    def __init__(self) -> None:
        self._previews = bpy.utils.previews.new()
        self._drawn: dict[str, tuple] = {}

    def icon_of(self, item: bpy.types.Material, kind: str) -> int:
        """Icon of a material's plot, as it is edited now.

        Raises
        ------
        ParameterFileError
            The material's parameters were damaged.
        ShaderError
            The material has lost its nodes.
        """
        edit = item.nfm.edit
        state = (
            item.nfm.parameters,
            item.nfm.slices,
            editing.group_of(item).nfm.applied,
            edit.show_original,
            sliders_of(edit),
        )
        if self._drawn.get(kind) != state:
            fitted = without_direction(editing.fitted_material(item).model)
            edited = without_direction(editing.edited_model(item))
            pixels = PLOTS[kind](
                edited, None if _equal(edited, fitted) else fitted, decode(item.nfm.slices)
            )
            self._put(kind, pixels)
            self._drawn[kind] = state
        return self._previews[kind].icon_id

    def swatch(self, color: tuple[float, ...]) -> int:
        """Icon of a square of one colour."""
        name = repr(color)
        if name not in self._previews:
            pixels = np.zeros((16, 16, 4), np.float32)
            pixels[3:13, 3:13] = (*color, 1.0)
            self._put(name, pixels)
        return self._previews[name].icon_id

    def _put(self, name: str, pixels: np.ndarray) -> None:
        preview = self._previews.get(name) or self._previews.new(name)
        preview.image_size = preview.icon_size = pixels.shape[1::-1]
        preview.image_pixels_float.foreach_set(np.ravel(pixels))
        preview.icon_pixels_float.foreach_set(np.ravel(pixels))

    def close(self) -> None:
        """Free the pixels."""
        bpy.utils.previews.remove(self._previews)


def _equal(one: FactorModel, other: FactorModel) -> bool:
    return all(
        np.allclose(getattr(one, f.name), getattr(other, f.name), rtol=1e-9, atol=0)
        for f in fields(one)
    )


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
