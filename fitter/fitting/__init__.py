# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit: objective, updates, joint steps, prior, appearance; of the isotropic model."""
