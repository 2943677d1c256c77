# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong on Blender's side."""

from ..fitter.errors import NfmError


class ShaderError(NfmError):
    """Cycles could not compile the shader, or this Blender has no OSL."""
