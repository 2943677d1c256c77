# SPDX-License-Identifier: GPL-3.0-or-later
"""Base lobes of the models, fitted once for all tests: those of anisotropic ones take seconds."""

from functools import cache

from fitter.shading.base_lobes import fit_base_lobes
from tests.models import ANISOTROPIC_MODELS, MODELS


@cache
def base_of(name):
    """Base lobes of a model by its name."""
    return fit_base_lobes((MODELS | ANISOTROPIC_MODELS)[name])
