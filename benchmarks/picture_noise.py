# SPDX-License-Identifier: GPL-3.0-or-later
"""What a few renders of one picture say about its noise, and about its error with the noise out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Noise:
    """Noise of a picture, relative to the mean of the converged one.

    mean : of the converged picture, radiance
    rmse : root mean squared error over pixels, channels and seeds
    p999 : 99.9th percentile of the absolute error over the same
    largest : the largest pixel / its own converged value, mean of the channels; a converged value
        under 1 % of the picture's mean counts as 1 %, so that a shadow's edge is no firefly
    """

    mean: float
    rmse: float
    p999: float
    largest: float


def noise_of(
    pictures: np.ndarray, converged: np.ndarray, samples: int, converged_samples: int
) -> Noise:
    """Noise of pictures (seeds, n, 3) against the converged picture (n, 3) of another seed.

    Each picture is compared with the mean, by samples, of the converged picture and the other
    seeds: independent of it, and as converged as what was rendered can be. Its own noise adds
    samples / (samples of that mean) to the squared error of an unbiased estimator, which is taken
    out.
    """
    others = (len(pictures) - 1) * samples
    total = converged * converged_samples + pictures.sum(0) * samples
    errors, ratios = [], []
    for picture in pictures:
        truth = (total - picture * samples) / (converged_samples + others)
        errors.append(picture - truth)
        floor = max(0.01 * truth.mean(), 1e-9)
        ratios.append((picture.mean(-1) / np.maximum(truth.mean(-1), floor)).max())
    errors = np.array(errors) / np.sqrt(1 + samples / (converged_samples + others))
    mean = float(total.mean() / (converged_samples + others + samples))
    scale = mean if mean > 0 else 1.0
    return Noise(
        mean=mean,
        rmse=float(np.sqrt((errors**2).mean()) / scale),
        p999=float(np.quantile(np.abs(errors), 0.999) / scale),
        largest=float(max(ratios)),
    )


def image_error(
    halves: tuple[np.ndarray, np.ndarray], truths: tuple[np.ndarray, np.ndarray]
) -> tuple[float, float]:
    """Bounds of the L1 error of a converged picture, relative to the truth's mean.

    halves, truths : two independent noisy versions each, arrays of one shape

    Upper: the L1 distance of the means, into which what noise is left adds. Lower: the error of
    one half counted with the sign of the error in the other, less two standard errors; noise is as
    often right as wrong there and cancels, but where the noise is larger than the error so is the
    error. With fireflies that most pixels have not met yet, both halves are too dark nearly
    everywhere and the lower bound is too high: believe it only where `p999` is small.
    """
    first, second = (half - truth for half, truth in zip(halves, truths, strict=True))
    mean = (truths[0].mean() + truths[1].mean()) / 2
    # one term for a pixel: its channels are not independent
    terms = ((np.sign(second) * first + np.sign(first) * second) / 2).mean(-1)
    # the halves' difference is noise alone; a term has a quarter of its variance
    noise = ((first - second).mean(-1) / 2) ** 2
    lower = terms.mean() - 2 * np.sqrt(noise.sum()) / noise.size
    return float(max(lower, 0) / mean), float(np.abs(first + second).mean() / 2 / mean)
