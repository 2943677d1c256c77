# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole jobs: reading, fitting and grading one file, or a folder of them."""
