# SPDX-License-Identifier: GPL-3.0-or-later
"""Files in and out: measured data, and fitted materials."""
