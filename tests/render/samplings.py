"""The samplings that every test of this folder holds for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sampling:
    """What a picture may be expected to show.

    name : identifier, as of material.nfm.sampling
    sees_points : whether lamps without size light it
    error : by how much of the light that a pixel should show it may be wrong, beyond its noise
    """

    name: str
    sees_points: bool
    error: float

    def __str__(self):
        return self.name


SAMPLINGS = (Sampling("REFERENCE", sees_points=False, error=0.0),)

# the naive baseline: right, but too noisy to test with on anything glossy
COSINE = Sampling("COSINE", sees_points=False, error=0.0)
