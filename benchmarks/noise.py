# SPDX-License-Identifier: GPL-3.0-or-later
"""What noise and missing bins cost: rendered PSNR of noisy fits against the clean tables.

Each value is multiplied by lognormal noise that keeps the mean, independent per bin and channel,
and a share of the bins is marked as missing. The clean and the noisy file are fitted alike, and
both are graded against the clean table; scene and PSNR are those of ./nfm bench fit.
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import replace

import numpy as np

from fitter.fitting import fit
from fitter.fitting.quality import DEFAULT_QUALITY, QUALITIES
from fitter.grading.metrics import tabulate
from fitter.measurement import Measurement

from . import experiment

TARGET = 1.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ./nfm bench noise."""
    parser.add_argument("--materials", metavar="A,B", default=",".join(experiment.MATERIALS))
    parser.add_argument("--noise", type=float, default=0.05, metavar="SIGMA")
    parser.add_argument("--missing", type=float, default=0.02, metavar="SHARE")
    parser.add_argument("--quality", choices=list(QUALITIES), default=DEFAULT_QUALITY)


def run(arguments: argparse.Namespace) -> int:
    """Fit, grade and print; returns 1 if a material loses more than the target."""
    materials = experiment.materials(arguments.materials.split(","))
    losses = []
    print(f"{'material':<28}{'clean':>8}{'noisy':>8}{'loss dB':>9}")
    for name, clean, psnr_of in materials:
        noisy = with_noise(clean, arguments.noise, arguments.missing, np.random.default_rng(0))
        fits = [fit.fit(measured, quality=arguments.quality) for measured in (clean, noisy)]
        psnr = [psnr_of(tabulate(found.model)) for found in fits]
        losses.append(psnr[0] - psnr[1])
        print(f"{name:<28}{psnr[0]:8.2f}{psnr[1]:8.2f}{losses[-1]:9.2f}", flush=True)
    print(f"loss: mean {statistics.mean(losses):.2f} dB, largest {max(losses):.2f} dB")
    return 1 if max(losses) >= TARGET else 0


def with_noise(
    clean: Measurement, noise: float, missing: float, rng: np.random.Generator
) -> Measurement:
    """The measurement as a noisy instrument would have taken it."""
    factor = np.exp(noise * rng.standard_normal(clean.f_r.shape) - noise**2 / 2)
    valid = clean.valid & (rng.random(clean.valid.shape) >= missing)
    return replace(clean, f_r=np.where(valid[..., None], clean.f_r * factor, 0), valid=valid)
