# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures that docs/RESULTS.md quotes; run with ./nfm bench NAME."""

import os

# As python -m fitter: one thread of linear algebra, before numpy is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
