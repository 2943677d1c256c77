# SPDX-License-Identifier: GPL-3.0-or-later
"""The two scenes of Peng et al. 2017, section 3.1: a sphere in Grace, the Buddha in Grove.

Pictures are exact sums over the texels of the map (fitter/pictures/sphere.py), so nothing is noisy.
There are no shadows and no interreflections: what differs between pictures is the BRDF.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from fitter.pictures.sphere import ENVIRONMENT_SHAPE, LitScene, SphereScene, box_filtered

from . import mesh

SPHERE_HEIGHT = 64
MESH_HEIGHT = 192


@dataclass(frozen=True)
class SceneSource:
    """What a scene is made of; small enough to be handed to other processes.

    name : for people, such as "sphere in Grace"
    environment : (64, 128, 3) radiance, as fitter/pictures/sphere.py wants it
    triangles : vertices (n, 3) and faces (m, 3) of a mesh; a sphere without
    """

    name: str
    environment: np.ndarray
    triangles: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def fingerprint(self) -> str:
        """Differs where pictures may differ."""
        digest = hashlib.sha256(f"{SPHERE_HEIGHT} {MESH_HEIGHT}".encode())
        for array in (self.environment, *(self.triangles or ())):
            digest.update(np.ascontiguousarray(array))
        return digest.hexdigest()

    def build(self) -> LitScene:
        """The scene, ready to render."""
        if self.triangles is None:
            return SphereScene([self.environment], SPHERE_HEIGHT)
        normals, mask = mesh.visible_normals(*self.triangles, MESH_HEIGHT)
        return LitScene(normals, mask, [self.environment])


def reduced(image: np.ndarray) -> np.ndarray:
    """A map (h, w, 3) in the resolution of the scenes; smaller ones are repeated first."""
    rows, columns = ENVIRONMENT_SHAPE
    repeats = max(-(-rows // image.shape[0]), -(-columns // image.shape[1]))
    enlarged = image.repeat(repeats, axis=0).repeat(repeats, axis=1)
    return box_filtered(enlarged, rows, columns)
