# SPDX-License-Identifier: GPL-3.0-or-later
"""The base lobes of models met before: a fit's own process has found them, or an undo returns."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import fields
from hashlib import sha256

from ..fitter.models.factors import Factors
from ..fitter.shading.shading import Shading

# Those of an anisotropic model are 2 MB.
MOST = 16

_known: OrderedDict[bytes, Shading] = OrderedDict()

# The model that was asked for last, and its key.
_last: tuple[Factors, bytes] | None = None


def remember(model: Factors, shading: Shading) -> Shading:
    """Keep the shading of a model; returns it."""
    key = _key(model)
    _known[key] = shading
    _known.move_to_end(key)
    if len(_known) > MOST:
        _known.popitem(last=False)
    return shading


def find(model: Factors) -> Shading | None:
    """The shading of a model with the same numbers."""
    key = _key(model)
    if key in _known:
        _known.move_to_end(key)
    return _known.get(key)


def forget() -> None:
    """Know nothing any more."""
    global _last
    _known.clear()
    _last = None


def is_same(one: Factors, other: Factors) -> bool:
    """Whether two models have the same numbers."""
    return one is other or _key(one) == _key(other)


def _key(model: Factors) -> bytes:
    # while a process finds the base lobes of a model, that model is asked for again and again
    global _last
    if _last is None or _last[0] is not model:
        digest = sha256(model.kind.encode())
        for field in fields(model):
            digest.update(getattr(model, field.name).tobytes())
        _last = model, digest.digest()
    return _last[1]


def register() -> None:
    """Nothing is known before the first fit."""


def unregister() -> None:
    forget()
