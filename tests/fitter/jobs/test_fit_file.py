# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from fitter import synthetic
from fitter.errors import MeasurementError, ParameterFileError
from fitter.fitting import prior, quality
from fitter.formats import parameter_file, readers
from fitter.formats.parameter_file import FittedMaterial
from fitter.grading import anisotropic_metrics, metrics
from fitter.jobs import fit_file
from fitter.jobs.fit_file import is_parameter_file, material_from_file, material_name
from fitter.models.anisotropic_model import AnisotropicModel


def test_fit_and_grade(short_fit, two_lobes):
    steps = []
    material = fit_file.fit_measurement(
        two_lobes, weight="log", quality="best", prior_strength=0.1, on_step=steps.append
    )
    assert material.name == "planted"
    assert material.source == two_lobes.source
    figures = material.fit
    assert figures["iterations"] == len(steps) > 5
    disorder = prior.disorder(material.model, 0.1)
    assert disorder > 0
    assert figures["objective"] == pytest.approx(steps[-1].error)
    assert (figures["quality"], figures["prior_strength"]) == ("best", 0.1)
    assert figures["weight"] == "log"
    error = metrics.mean_log_error(metrics.tabulate(material.model), two_lobes)
    assert figures["mean_log_error"] == pytest.approx(error, rel=1e-9)
    assert 0.05 < figures["largest_directional_albedo"] < 2
    # those of the base are computed where the base is needed, once
    assert not [name for name in figures if name.startswith("native")]
    assert figures["bins_usable"] == two_lobes.valid.sum()
    assert figures["bins_below_horizon"] == (~two_lobes.valid).sum()
    assert figures["bins_negative"] == figures["bins_not_finite"] == 0
    # and what was found can be stored
    assert parameter_file.loads(parameter_file.dumps(material)).fit == figures


def test_on_step_may_stop_the_fit(short_fit, two_lobes):
    def stop(step):
        raise InterruptedError

    with pytest.raises(InterruptedError):
        fit_file.fit_measurement(two_lobes, on_step=stop)


def test_parameter_files_are_loaded_whatever_they_are_called(tmp_path, random_model):
    path = tmp_path / "gold.binary"
    parameter_file.save(path, FittedMaterial("gold", random_model(0)))
    assert is_parameter_file(path)
    assert material_from_file(path).name == "gold"


def test_figures_of_earlier_versions_are_loaded(tmp_path, random_model):
    """Earlier files have the error of native sampling among the figures of the fit."""
    path = tmp_path / "gold.nfm.json"
    figures = {"native_error": 0.0012, "native_directional_error": 0.02, "native_psnr": 61.5}
    parameter_file.save(path, FittedMaterial("gold", random_model(0), fit=figures))
    assert material_from_file(path).fit == figures


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"{", True),
        (b"\xef\xbb\xbf {", True),
        (b" \r\n\t{}", True),
        (b"", False),
        (b"Z\0\0\0", False),
    ],
)
def test_content_decides(tmp_path, content, expected):
    path = tmp_path / "a.nfm.json"
    path.write_bytes(content)
    assert is_parameter_file(path) is expected


def test_missing_files_are_reported_by_their_reader(tmp_path):
    with pytest.raises(ParameterFileError, match=r"a\.nfm\.json"):
        material_from_file(tmp_path / "a.nfm.json")
    with pytest.raises(MeasurementError, match=r"a\.binary"):
        material_from_file(tmp_path / "a.binary")
    with pytest.raises(MeasurementError):
        material_from_file(tmp_path)


@pytest.mark.parametrize(
    ("file_name", "expected"),
    [
        ("gold.binary", "gold"),
        ("/a/b/red.metal.binary", "red.metal"),
        ("gold.nfm.json", "gold"),
        ("GOLD.NFM.JSON", "GOLD"),
        ("gold", "gold"),
        (".binary", ".binary"),
        ("x" * 100 + ".binary", "x" * 60),
        ("a\nb.binary", r"a\nb"),
    ],
)
def test_material_name(file_name, expected):
    assert material_name(file_name) == expected


@pytest.fixture
def silk(tmp_path):
    path = tmp_path / "silk.bin"
    synthetic.write_sample(path, "shot-silk")
    return path


@pytest.fixture
def short_anisotropic_fit(monkeypatch):
    for name in quality.ANISOTROPIC_QUALITIES:
        monkeypatch.setitem(quality.ANISOTROPIC_QUALITIES, name, quality.Work(1, 2, 0, 1, 0, 2))


def test_anisotropic_file(short_anisotropic_fit, silk):
    steps = []
    material = material_from_file(silk, encoding="linear", on_step=steps.append)
    assert isinstance(material.model, AnisotropicModel)
    assert (material.name, material.source.format) == ("silk", "utia-bin")
    figures = material.fit
    assert figures["iterations"] == len(steps) >= 4
    assert figures["encoding"] == "linear"
    measurement = readers.read(silk)
    table = anisotropic_metrics.tabulate(material.model)
    psnr = 10 * np.log10(measurement.f_r.max() ** 2 / np.mean((table - measurement.f_r) ** 2))
    assert figures["numeric_psnr"] == pytest.approx(psnr, rel=1e-9)
    error = anisotropic_metrics.mean_log_error(table, measurement)
    assert figures["mean_log_error"] == pytest.approx(error, rel=1e-9)
    assert 0 < error < 0.5
    assert figures["bins_usable"] == 288 * 288
    assert -90 <= figures["anisotropy_direction"] < 90
    assert 0 < figures["largest_directional_albedo"] <= 1
    # and what was found can be stored
    again = parameter_file.loads(parameter_file.dumps(material))
    assert again.fit == figures
    assert again.model.ndf.tobytes() == material.model.ndf.tobytes()
