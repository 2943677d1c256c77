"""The samplings that every test of this folder holds for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sampling:
    """What a picture may be expected to show.

    name : identifier, as of material.nfm.sampling
    sees_points : whether lamps without size light it
    error : by how much of the light that a pixel should show it may be wrong, beyond its noise
    kept_without_caustics, kept_by_filter_glossy : shares of the light that a metal wall throws on
        a diffuse floor, in test_scene_switches.py
    """

    name: str
    sees_points: bool
    error: float
    kept_without_caustics: float
    kept_by_filter_glossy: float

    def __str__(self):
        return self.name


SAMPLINGS = (
    Sampling(
        "NATIVE",
        sees_points=True,
        error=0.01,
        kept_without_caustics=0.0,
        kept_by_filter_glossy=0.77,
    ),
    Sampling(
        "SMOOTH",
        sees_points=True,
        error=0.005,
        kept_without_caustics=0.0,
        kept_by_filter_glossy=0.77,
    ),
    Sampling(
        "EXACT",
        sees_points=False,
        error=0.0,
        kept_without_caustics=0.0,
        kept_by_filter_glossy=0.77,
    ),
    Sampling(
        "REFERENCE",
        sees_points=False,
        error=0.0,
        kept_without_caustics=1.0,
        kept_by_filter_glossy=0.73,
    ),
)
