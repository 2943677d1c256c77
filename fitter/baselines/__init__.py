# SPDX-License-Identifier: GPL-3.0-or-later
"""Models of others, to compare with; nothing else in the fitter knows them."""
