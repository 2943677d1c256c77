# SPDX-License-Identifier: GPL-3.0-or-later
"""How good a fit is: errors over the data, readability, slices."""
