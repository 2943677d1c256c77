# SPDX-License-Identifier: GPL-3.0-or-later
"""Results without fits."""

import hashlib
from dataclasses import replace

import numpy as np
import pytest

from compare.grading import Grades, Result
from compare.models import INDEPENDENT_G, KEYS, OURS
from fitter.grading.slices import INCIDENCE, THETA_O
from tests.models import MODELS


@pytest.fixture(scope="session")
def make_result():
    """A result; psnr: that of each model in both scenes, objective: of the first model."""

    def make(name="gold", psnr=(50, 40, 45, 30), objective=1e-3, n_scenes=2):
        rng = np.random.default_rng(len(name))
        pictures = rng.uniform(0.1, 1, (1 + len(KEYS), 12, 8, 3)).astype(np.float32)
        pictures[:, :2] = np.nan
        grades = {
            key: Grades(
                n_parameters=(822, 816, 24300, 10)[n],
                seconds=1.5 + n,
                objective=objective * (n + 1),
                mean_log_error=0.01 * (n + 1),
                numeric_psnr=60.0 - n,
                rendered_psnr=tuple(psnr[n] + scene for scene in range(n_scenes)),
            )
            for n, key in enumerate(KEYS)
        }
        slices = rng.uniform(0.01, 10, (1 + len(KEYS), len(INCIDENCE), len(THETA_O), 3))
        slices[0, :, -5:] = np.nan
        factors = MODELS["plastic"]
        by_channel = replace(factors, scale=np.diag(factors.scale.sum(0)))
        return Result(
            name=name,
            sha256=hashlib.sha256(name.encode()).hexdigest(),
            grades=grades,
            pictures=(pictures,) * n_scenes,
            slices=slices.astype(np.float32),
            factors={OURS: factors, INDEPENDENT_G: by_channel},
        )

    return make
