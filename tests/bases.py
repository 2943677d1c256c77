# SPDX-License-Identifier: GPL-3.0-or-later
"""Base lobes of the models, fitted once for all tests: those of anisotropic ones take seconds."""

from functools import cache

from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import fit_base_lobes
from fitter.shading.shading import Shading
from tests.models import ANISOTROPIC_MODELS, MODELS

ALL_MODELS = MODELS | ANISOTROPIC_MODELS


@cache
def base_of(name):
    """Base lobes of a model by its name."""
    return fit_base_lobes(ALL_MODELS[name])


@cache
def shading_of(name):
    """The same with their error."""
    return Shading(base_of(name), base_error(ALL_MODELS[name], base_of(name)))
