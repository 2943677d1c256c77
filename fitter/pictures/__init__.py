# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures without noise, summed exactly over environment maps."""
