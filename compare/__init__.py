# SPDX-License-Identifier: GPL-3.0-or-later
"""Our model against others, material by material; run with ./nfm compare."""
