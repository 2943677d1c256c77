# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from fitter.anisotropic_measurement import AnisotropicMeasurement
from fitter.errors import NfmError
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.jobs import library
from fitter.jobs.library import ENTRIES
from fitter.models.tables import largest_directional_albedo
from runner.environment import CHECKOUT
from tests import models

FOLDER = CHECKOUT / "library"
BY_KEY = {entry.key: entry for entry in ENTRIES}
MEGABYTE = 1_000_000


def shipped(entry):
    return parameter_file.load(FOLDER / f"{entry.key}.nfm.json")


def test_what_is_in_it():
    measured = [entry for entry in ENTRIES if entry.is_measured]
    assert len(measured) == 12
    assert len(ENTRIES) - len(measured) >= 12
    for values in ([entry.key for entry in ENTRIES], [entry.title for entry in ENTRIES]):
        assert max(Counter(values).values()) == 1
    for entry in ENTRIES:
        if entry.is_measured:
            assert "RGL" in entry.author
            assert entry.catalogue.startswith("Measured/")
            assert entry.source in entry.description
        else:
            assert entry.title.endswith("(synthetic)")
            assert entry.catalogue.startswith("Synthetic/")
            assert "not measured" in entry.description


def test_every_entry_has_its_files_and_nothing_else_is_there():
    wanted = {f"{entry.key}{suffix}" for entry in ENTRIES for suffix in (".nfm.json", ".png")}
    assert {path.name for path in FOLDER.iterdir()} == wanted | {"README.md"}


def test_it_is_small():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 3 * MEGABYTE


@pytest.mark.parametrize("key", BY_KEY)
def test_shipped_fits(key):
    """Made of the sources as they are now; `./nfm library build` makes them again."""
    entry, material = BY_KEY[key], shipped(BY_KEY[key])
    assert material.name == entry.title
    assert material.fit["quality"] == "standard"
    assert material.fit["mean_log_error"] < 0.6
    if material.model.kind == "isotropic":
        assert largest_directional_albedo(material.model) <= 1.001
    if entry.is_measured:
        assert (material.source.file_name, material.source.format) == (entry.source, "rgl")
    else:
        assert material.source == library.synthetic_source(entry)


def test_sources_of_the_measured_ones(shared):
    for entry in filter(lambda entry: entry.is_measured, ENTRIES):
        content = (shared / "data" / "rgl" / entry.source).read_bytes()
        assert shipped(entry).source.sha256 == hashlib.sha256(content).hexdigest()


def test_measurements_of_analytic_models(tmp_path):
    brass = library.measurement(BY_KEY["brushed-brass"], tmp_path)
    assert isinstance(brass, AnisotropicMeasurement)
    assert brass.valid.all()
    rubber = library.measurement(BY_KEY["rubber-black"], tmp_path)
    assert rubber.f_r[rubber.valid].min() > 0
    assert rubber.report.usable == rubber.valid.sum()
    assert rubber.source == library.synthetic_source(BY_KEY["rubber-black"])


def test_a_missing_source(tmp_path):
    with pytest.raises(NfmError, match=r"^chm_mint_rgb\.bsdf: no such file; .* --rgl"):
        library.measurement(BY_KEY["chm_mint"], tmp_path)


def test_fits_once(tmp_path, monkeypatch):
    done = []

    def fitted(measurement, *, quality):
        done.append(measurement.source.file_name)
        figures = {"weight": "display-gamma", "quality": quality, "prior_strength": 1.0}
        return FittedMaterial("x", models.MODELS["matte"], measurement.source, figures)

    settings = library.Settings(weight="display-gamma", prior_strength=1.0)
    monkeypatch.setattr(library, "fit_measurement", fitted)
    monkeypatch.setattr(library, "Settings", lambda: settings)
    output = tmp_path / "porcelain.nfm.json"
    entry = BY_KEY["porcelain"]
    assert library.fit(entry, tmp_path, output)
    assert not library.fit(entry, tmp_path, output)
    assert parameter_file.load(output).name == "Porcelain (synthetic)"
    # another model is another source
    assert library.fit(replace(entry, source=BY_KEY["rubber-black"].source), tmp_path, output)
    assert len(done) == 2


@pytest.mark.parametrize("model", [models.MODELS["paint"], models.anisotropic_pile()])
def test_five_digits_are_enough(model):
    """Compact text gives the same values within a few 1e-5, and is half as long."""
    material = FittedMaterial("x", model)
    text = parameter_file.dumps(material, library.DIGITS)
    again = parameter_file.loads(text).model
    assert len(text) < 0.55 * len(parameter_file.dumps(material))
    rng = np.random.default_rng(0)
    wi, wo = (models_directions(rng) for _ in range(2))
    np.testing.assert_allclose(again.f_r(wi, wo), model.f_r(wi, wo), rtol=3e-4)


def models_directions(rng, n=500):
    directions = rng.standard_normal((n, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 0.1
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)
