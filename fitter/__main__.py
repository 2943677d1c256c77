# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m fitter: fit and evaluate without Blender."""

import sys

from .command_line import main

sys.exit(main(sys.argv[1:]))
