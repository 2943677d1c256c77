# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of the anisotropic model, by the same steps."""
