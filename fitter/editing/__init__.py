# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions from models to models: curves, sliders, blends, and how they are written."""
