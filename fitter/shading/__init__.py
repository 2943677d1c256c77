# SPDX-License-Identifier: GPL-3.0-or-later
"""What a renderer needs of a model: closures of Cycles that follow it, and stand-ins."""
