# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures that docs/RESULTS.md quotes; run with ./nfm bench NAME."""
