# SPDX-License-Identifier: GPL-3.0-or-later
"""The two places of the panel "Measured BRDF", as classes that panels inherit from."""


class InMaterialProperties:
    """In the Material tab of the properties editor."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"


class InShaderEditor:
    """In the sidebar of the shader editor."""

    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Measured BRDF"
