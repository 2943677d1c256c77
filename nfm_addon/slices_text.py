# SPDX-License-Identifier: GPL-3.0-or-later
"""Slices of a measurement as text in a material, 12 kB, to compare with where the file is not."""

from __future__ import annotations

import base64
import binascii

import numpy as np

from ..fitter.grading.slices import INCIDENCE, THETA_O

SHAPE = (len(INCIDENCE), len(THETA_O), 3)
DTYPE = np.dtype("<f2")

# Half precision ends at 65504; values beyond are grazing ones that no plot shows.
LARGEST = 6e4


def encode(slices: np.ndarray) -> str:
    """Text of slices (4, 359, 3), 1/sr, NaN where nothing was measured."""
    return base64.b64encode(np.minimum(slices, LARGEST).astype(DTYPE).tobytes()).decode("ascii")


def decode(text: str) -> np.ndarray | None:
    """The slices; None for a text that `encode` has not written."""
    try:
        data = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        return None
    if len(data) != np.prod(SHAPE) * DTYPE.itemsize:
        return None
    return np.frombuffer(data, DTYPE).reshape(SHAPE).astype(np.float32)
