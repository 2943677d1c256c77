# SPDX-License-Identifier: GPL-3.0-or-later
"""The models of a comparison, in the order of its tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from fitter.baselines import bivariate, independent_g, principled
from fitter.fitting import fit
from fitter.fitting.quality import DEFAULT_QUALITY
from fitter.grading.metrics import Brdf
from fitter.measurement import Measurement


class Fitted(Brdf, Protocol):
    """A model that was fitted."""

    @property
    def n_parameters(self) -> int:
        """Count of its numbers."""


@dataclass(frozen=True)
class Settings:
    """What a fit depends on besides the measurement.

    weight : a name in weights.WEIGHTS
    quality : a name in quality.QUALITIES
    golden_section : fit Independent-G as Bagher et al. 2016 did
    """

    weight: str
    quality: str = DEFAULT_QUALITY
    golden_section: bool = False


@dataclass(frozen=True)
class Contender:
    """One model: a key for files, a label for people, a colour for charts, and how to fit it."""

    key: str
    label: str
    color: str
    fit: Callable[[Measurement, Settings], Fitted]


OURS, INDEPENDENT_G, BIVARIATE, PRINCIPLED = "shared3", "independent-g", "bivariate", "principled"

# The colours are those of Okabe and Ito, which colour-blind people tell apart.
CONTENDERS = (
    Contender(
        OURS,
        "Three lobes",
        "#0072B2",
        lambda measurement, settings: (
            fit.fit(measurement, weight=settings.weight, quality=settings.quality).model
        ),
    ),
    Contender(
        INDEPENDENT_G,
        "Independent-G",
        "#D55E00",
        lambda measurement, settings: independent_g.fit(
            measurement,
            weight=settings.weight,
            quality=settings.quality,
            golden_section=settings.golden_section,
        ),
    ),
    Contender(
        BIVARIATE,
        "Bivariate",
        "#009E73",
        lambda measurement, settings: bivariate.fit(measurement, weight=settings.weight),
    ),
    Contender(
        PRINCIPLED,
        "Principled",
        "#CC79A7",
        lambda measurement, settings: principled.fit(measurement, weight=settings.weight),
    ),
)
KEYS = tuple(contender.key for contender in CONTENDERS)
