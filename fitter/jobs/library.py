# SPDX-License-Identifier: GPL-3.0-or-later
"""What the material library holds: measured materials and analytic ones, each with its source.

The measured ones are 12 files of the RGL material database (Dupuy and Jakob 2018), which its
authors offer under CC0 1.0. The others are analytic BRDFs of `synthetic`, tabulated on the grid of
a measurement and fitted like one; nobody measured them, and their names and files say "synthetic".
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import synthetic
from ..anisotropic_measurement import AnisotropicMeasurement, ClampReport
from ..errors import NfmError, shown_name
from ..formats import parameter_file, readers
from ..formats.readers import AnyMeasurement
from ..grading import anisotropic_metrics
from ..measurement import BinReport, Measurement, Source
from ..synthetic import (
    ANISOTROPIC_SAMPLES,
    SAMPLES,
    AnalyticBrdf,
    AnisotropicBrdf,
    AnisotropicGgxLobe,
    GgxLobe,
    SheenLobe,
)
from .batch import Settings, fit_of
from .fit_file import fit_measurement

SYNTHETIC = "synthetic"  # Source.format of what was not measured

LICENSE = "CC0 1.0"
RGL_AUTHOR = "Jonathan Dupuy, Wenzel Jakob (EPFL RGL), measurement; NFM, fit"
OWN_AUTHOR = "NFM"

DIGITS = 5  # of the numbers in the library's parameter files


@dataclass(frozen=True)
class Entry:
    """A material of the library.

    key : stem of its files
    title : name of the material
    catalogue : of the asset browser, with its parents
    source : name of an RGL file, or an analytic BRDF
    about : what one sees, a sentence without its full stop
    """

    key: str
    title: str
    catalogue: str
    source: str | AnalyticBrdf | AnisotropicBrdf
    about: str

    @property
    def is_measured(self) -> bool:
        """Whether the material exists."""
        return isinstance(self.source, str)

    @property
    def author(self) -> str:
        """Who measured and fitted it."""
        return RGL_AUTHOR if self.is_measured else OWN_AUTHOR

    @property
    def description(self) -> str:
        """For the asset browser."""
        origin = (
            f"Measured: {self.source}, RGL material database"
            if self.is_measured
            else "Synthetic: fitted to an analytic model, not measured"
        )
        return f"{self.about}. {origin}"

    @property
    def tags(self) -> tuple[str, ...]:
        """For the asset browser."""
        kind = ("measured", "rgl") if self.is_measured else (SYNTHETIC,)
        return (*kind, *(["anisotropic"] if isinstance(self.source, AnisotropicBrdf) else []))


def measurement(entry: Entry, rgl_folder: Path) -> AnyMeasurement:
    """What an entry is fitted to.

    rgl_folder : with the RGL files

    Raises
    ------
    NfmError
        The RGL file is not there or cannot be read.
    """
    if isinstance(entry.source, str):
        path = rgl_folder / entry.source
        if not path.is_file():
            raise NfmError(
                f"{shown_name(path)}: no such file; download it from the RGL material database, "
                "and say with --rgl where it is"
            )
        return readers.read(path)
    source = synthetic_source(entry)
    if isinstance(entry.source, AnisotropicBrdf):
        table = anisotropic_metrics.tabulate(entry.source)
        valid = np.ones(table.shape[:-1], bool)
        report = ClampReport(total=valid.size, negative=0, non_finite=0)
        return AnisotropicMeasurement(table, valid, source, report, "linear")
    f_r, valid = synthetic.tabulate(entry.source)
    below = valid.size - int(valid.sum())
    report = BinReport(total=valid.size, below_horizon=below, negative=0, non_finite=0)
    return Measurement(f_r, valid, source, report)


def synthetic_source(entry: Entry) -> Source:
    """What stands in the place of a file for an analytic BRDF: its own numbers."""
    digest = hashlib.sha256(repr(entry.source).encode()).hexdigest()
    return Source(f"{SYNTHETIC} {entry.key}", SYNTHETIC, digest)


def fit(entry: Entry, rgl_folder: Path, output: Path) -> bool:
    """Write the parameter file of an entry; whether it had to be fitted.

    A file that holds the fit of this source already is left alone.

    Raises
    ------
    NfmError
        The source cannot be read, or the file not written.
    """
    measured = measurement(entry, rgl_folder)
    settings = Settings()
    if fit_of(output, measured.source.sha256, settings):
        return False
    fitted = fit_measurement(measured, quality=settings.quality)
    parameter_file.save(output, replace(fitted, name=entry.title), DIGITS)
    return True


def _rgl(stem: str, title: str, catalogue: str, about: str) -> Entry:
    return Entry(stem, title, f"Measured/{catalogue}", f"{stem}_rgb.bsdf", about)


def _own(
    key: str, title: str, catalogue: str, brdf: AnalyticBrdf | AnisotropicBrdf, about: str
) -> Entry:
    return Entry(key, f"{title} (synthetic)", f"Synthetic/{catalogue}", brdf, about)


ENTRIES = (
    _rgl("aurora_white", "Aurora White", "Shimmering", "White with a shimmer"),
    _rgl(
        "cc_green_malachite", "Green Malachite", "Colour Shift", "Green, turns to yellow and teal"
    ),
    _rgl("cc_iris_purple_gem", "Iris Purple Gem", "Colour Shift", "Dark blue, purple at the rim"),
    _rgl("cc_nothern_aurora", "Northern Aurora", "Colour Shift", "Dark, turns from teal to purple"),
    _rgl(
        "irid_flake_paint1_fine",
        "Iridescent Flake Paint, Fine",
        "Colour Shift",
        "Dark paint with iridescent flakes",
    ),
    _rgl("chm_light_blue", "Chrome Light Blue", "Metallic", "Steel blue metal, narrow highlight"),
    _rgl("chm_mint", "Chrome Mint", "Metallic", "Grey green metal, highlight of mint"),
    _rgl("chm_orange", "Chrome Orange", "Metallic", "Orange red metal, narrow highlight"),
    _rgl("vch_silk_blue", "Silk Blue", "Metallic", "Deep blue metal, soft highlight"),
    _rgl("cg_sunflower", "Sunflower", "Gloss and Matte", "Saturated yellow, glossy"),
    _rgl("cm_military_green", "Military Green", "Gloss and Matte", "Dark green, soft gloss"),
    _rgl("colodur_napoli_4f", "Colodur Napoli", "Gloss and Matte", "Red, matte"),
    _own(
        "brushed-aluminium",
        "Brushed Aluminium",
        "Metal",
        AnisotropicBrdf(
            diffuse=(0.01, 0.01, 0.01), lobes=(AnisotropicGgxLobe(0.12, 0.4, (0.91, 0.92, 0.92)),)
        ),
        "Anisotropic, marks along the tangent",
    ),
    _own(
        "brushed-brass",
        "Brushed Brass",
        "Metal",
        ANISOTROPIC_SAMPLES["brushed-brass"],
        "Anisotropic, marks along the tangent",
    ),
    _own(
        "brushed-steel",
        "Brushed Steel",
        "Metal",
        AnisotropicBrdf(
            diffuse=(0.01, 0.01, 0.01),
            lobes=(
                AnisotropicGgxLobe(0.15, 0.5, (0.56, 0.55, 0.53), weight=0.75),
                AnisotropicGgxLobe(0.45, 0.55, (0.56, 0.55, 0.53), weight=0.25),
            ),
        ),
        "Anisotropic, marks along the tangent, with a haze",
    ),
    _own("satin-copper", "Satin Copper", "Metal", SAMPLES["brushed-copper"], "Copper, satin"),
    _own(
        "satin-gold",
        "Satin Gold",
        "Metal",
        AnalyticBrdf((0.0, 0.0, 0.0), (GgxLobe(0.15, (1.0, 0.78, 0.34)),)),
        "Gold, satin",
    ),
    _own(
        "cast-iron",
        "Cast Iron",
        "Metal",
        AnalyticBrdf((0.015, 0.015, 0.016), (GgxLobe(0.42, (0.32, 0.31, 0.30)),)),
        "Grey and rough",
    ),
    _own("satin-violet", "Satin, Violet", "Fabric", SAMPLES["satin"], "A sheen over a soft gloss"),
    _own("velvet-crimson", "Velvet, Crimson", "Fabric", SAMPLES["velvet"], "Bright at its rims"),
    _own(
        "velvet-midnight",
        "Velvet, Midnight",
        "Fabric",
        AnalyticBrdf((0.004, 0.007, 0.03), (SheenLobe(0.22, (0.12, 0.18, 0.5)),)),
        "Dark, bright at its rims",
    ),
    _own(
        "felt-grey",
        "Felt, Grey",
        "Fabric",
        AnalyticBrdf((0.20, 0.20, 0.21), (SheenLobe(0.6, (0.18, 0.18, 0.18)),)),
        "Matte, with a soft rim",
    ),
    _own(
        "shot-silk",
        "Shot Silk",
        "Fabric",
        ANISOTROPIC_SAMPLES["shot-silk"],
        "Anisotropic, red and blue threads at right angles",
    ),
    _own(
        "sateen-ivory",
        "Sateen, Ivory",
        "Fabric",
        AnisotropicBrdf(
            diffuse=(0.36, 0.31, 0.22),
            lobes=(AnisotropicGgxLobe(0.22, 0.6, (0.34, 0.31, 0.25), weight=0.7),),
        ),
        "Anisotropic, shines across its threads",
    ),
    _own(
        "car-paint-copper",
        "Car Paint, Copper",
        "Paint",
        SAMPLES["copper-paint"],
        "Metallic flakes under a clear coat",
    ),
    _own(
        "car-paint-midnight",
        "Car Paint, Midnight Blue",
        "Paint",
        AnalyticBrdf(
            (0.004, 0.008, 0.03),
            (
                GgxLobe(0.04, (0.04, 0.04, 0.04), weight=0.8),
                GgxLobe(0.28, (0.06, 0.14, 0.5), weight=0.4),
            ),
        ),
        "Metallic flakes under a clear coat",
    ),
    _own(
        "car-paint-pearl",
        "Car Paint, Pearl White",
        "Paint",
        AnalyticBrdf(
            (0.62, 0.61, 0.58),
            (
                GgxLobe(0.045, (0.04, 0.04, 0.04), weight=0.8),
                GgxLobe(0.35, (0.30, 0.28, 0.26), weight=0.3),
            ),
        ),
        "Pearl pigments under a clear coat",
    ),
    _own(
        "wall-paint-sage",
        "Wall Paint, Sage",
        "Paint",
        AnalyticBrdf((0.30, 0.36, 0.27), (GgxLobe(0.55, (0.04, 0.04, 0.04), weight=0.6),)),
        "Eggshell finish",
    ),
    _own("plastic-teal", "Plastic, Teal", "Plastic and Rubber", SAMPLES["rough-plastic"], "Rough"),
    _own("plastic-red", "Plastic, Red", "Plastic and Rubber", SAMPLES["glossy-plastic"], "Glossy"),
    _own(
        "rubber-black",
        "Rubber, Black",
        "Plastic and Rubber",
        AnalyticBrdf((0.022, 0.022, 0.023), (GgxLobe(0.5, (0.045, 0.045, 0.045)),)),
        "Dark and dull",
    ),
    _own(
        "leather-brown",
        "Leather, Brown",
        "Paper, Leather and Ceramic",
        AnalyticBrdf(
            (0.13, 0.055, 0.025),
            (
                GgxLobe(0.3, (0.04, 0.04, 0.04), weight=0.5),
                GgxLobe(0.6, (0.045, 0.04, 0.035), weight=0.5),
            ),
        ),
        "A soft gloss on brown",
    ),
    _own(
        "paper-white",
        "Paper, White",
        "Paper, Leather and Ceramic",
        AnalyticBrdf((0.78, 0.77, 0.74), (GgxLobe(0.75, (0.035, 0.035, 0.035), weight=0.5),)),
        "Uncoated",
    ),
    _own(
        "porcelain",
        "Porcelain",
        "Paper, Leather and Ceramic",
        AnalyticBrdf((0.72, 0.71, 0.68), (GgxLobe(0.04, (0.045, 0.045, 0.045)),)),
        "White under a glaze",
    ),
)
