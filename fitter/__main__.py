# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m fitter: fit and evaluate without Blender."""

import os
import sys

# The fit's matrices are small: threads of the linear algebra library gain nothing and, on a busy
# machine, wait for each other. One thread also gives the same bits on any number of cores. numpy
# reads this when it is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from .command_line import main

sys.exit(main(sys.argv[1:]))
