# SPDX-License-Identifier: GPL-3.0-or-later
"""The base lobes of a model with their error, and how they get from one process to another."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from ..models.factors import Factors
from . import closures
from .base_error import BaseError, base_error
from .base_lobes import BaseLobes, fit_base_lobes


@dataclass(frozen=True)
class Shading:
    """What the samplings with base lobes need of a model, and takes seconds to find."""

    base: BaseLobes
    error: BaseError


def takes_seconds(model: Factors) -> bool:
    """Whether `shade` is nothing to wait for, unless it is to make a draft."""
    return model.kind == "anisotropic"


def shade(model: Factors, *, draft: bool = False) -> Shading:
    """Fit the base lobes of a model, as a draft or as they should be, and compare."""
    base = fit_base_lobes(model, draft=draft)
    return Shading(base, base_error(model, base))


def save(path: str | os.PathLike, shading: Shading) -> None:
    """Write to a file (.npz) that `load` reads, for the use of this program alone."""
    base = shading.base
    np.savez(
        path,
        closures=closures.dumps(base.closures),
        theta_o=base.theta_o,
        weights=base.weights,
        picking=base.picking,
        error=list(vars(shading.error).values()),
    )


def load(path: str | os.PathLike) -> Shading:
    """Read what `save` wrote."""
    with np.load(path) as file:
        base = BaseLobes(
            closures.loads(str(file["closures"])), file["theta_o"], file["weights"], file["picking"]
        )
        return Shading(base, BaseError(*file["error"].tolist()))
