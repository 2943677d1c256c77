# SPDX-License-Identifier: GPL-3.0-or-later
"""Read measured BRDFs and fit the non-parametric factor microfacet model to them.

Needs numpy and the standard library, nothing of Blender. See docs/ARCHITECTURE.md.
"""
