# SPDX-License-Identifier: GPL-3.0-or-later
"""The two models, and what follows from their numbers alone."""
