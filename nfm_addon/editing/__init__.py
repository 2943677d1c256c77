# SPDX-License-Identifier: GPL-3.0-or-later
"""From curves, sliders and blend of a material to its shader.

`refresh` is the whole of it: it compares what a material asks for with what its shader was made
for, and does what is missing. Whoever changes something only has to see to it that `refresh` is
called (live.py).
"""

from .documents import apply_document, document_of
from .drawn_curves import draw_curves, drawn_handles, reset_curves
from .edited_model import edited_model, largest_albedo
from .own_nodes import group_of, has_own_nodes, measured_materials, own_group
from .shader import adopt, give_up, is_drafted, refresh, slow_model
from .state import fitted_material

__all__ = (
    "adopt",
    "apply_document",
    "document_of",
    "draw_curves",
    "drawn_handles",
    "edited_model",
    "fitted_material",
    "give_up",
    "group_of",
    "has_own_nodes",
    "is_drafted",
    "largest_albedo",
    "measured_materials",
    "own_group",
    "refresh",
    "reset_curves",
    "slow_model",
)
