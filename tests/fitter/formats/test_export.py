# SPDX-License-Identifier: GPL-3.0-or-later

import numpy as np
import pytest

from fitter.command_line import FAILED, main
from fitter.errors import MeasurementError
from fitter.fitting.problem import Problem
from fitter.formats import export, merl, parameter_file, utia
from fitter.formats.parameter_file import FittedMaterial
from fitter.geometry import directions_from_rusinkiewicz
from tests import models
from tests.independent_readers import merl_look_up, utia_look_up
from tests.rgl_files import spherical


@pytest.fixture(scope="module")
def model():
    return models.MODELS["paint"]


@pytest.fixture(scope="module")
def exported(tmp_path_factory, model):
    path = tmp_path_factory.mktemp("exported") / "paint.binary"
    export.write(path, model)
    yield path
    path.unlink()


def test_round_trip_with_our_reader(exported, model):
    measurement = merl.read(exported)
    assert measurement.report.negative == measurement.report.non_finite == 0
    rng = np.random.default_rng(0)
    bins = np.argwhere(measurement.valid)[rng.integers(0, measurement.valid.sum(), 2000)]
    h, d, p = (bins + 0.5).T
    wi, wo = directions_from_rusinkiewicz((h / 90) ** 2 * np.pi / 2, np.radians(d), np.radians(p))
    np.testing.assert_allclose(measurement.f_r[tuple(bins.T)], model.f_r(wi, wo), rtol=1e-12)


def test_round_trip_with_an_independent_reader(exported, model):
    rng = np.random.default_rng(1)
    compared = 0
    for h, d, p in zip(*(rng.integers(0, n, 200) for n in (90, 90, 180)), strict=True):
        angles = ((h + 0.5) ** 2 / 90**2 * np.pi / 2, np.radians(d + 0.5), np.radians(p + 0.5))
        wi, wo = directions_from_rusinkiewicz(*angles)
        found = merl_look_up(exported, *angles)
        if wi[2] <= 0 or wo[2] <= 0:
            assert max(found) < 0
            continue
        np.testing.assert_allclose(found, model.f_r(wi[None], wo[None])[0], rtol=1e-9)
        compared += 1
    assert compared > 80


@pytest.mark.parametrize("kind", ["isotropic", "anisotropic"])
def test_utia_round_trip(tmp_path, model, kind):
    model = models.anisotropic_pile() if kind == "anisotropic" else model
    path = tmp_path / "brush.bin"
    export.write(path, model)
    measurement = utia.read_bin(path)
    rng = np.random.default_rng(2)
    for i, j, k, m in zip(*(rng.integers(0, n, 50) for n in (6, 48, 6, 48)), strict=True):
        wi, wo = (
            spherical(np.radians(15 * t), np.radians(7.5 * p))[None] for t, p in ((i, j), (k, m))
        )
        wanted = model.f_r(wi, wo)[0]
        np.testing.assert_allclose(utia_look_up(path, i, j, k, m), wanted, rtol=1e-9)
        np.testing.assert_allclose(measurement.f_r[i, j, k, m], wanted, rtol=1e-9)


def test_anisotropic_model_is_no_merl_file(tmp_path):
    path = tmp_path / "brush.binary"
    with pytest.raises(MeasurementError, match=r"^brush\.binary: an anisotropic .* in \.bin"):
        export.write(path, models.anisotropic_pile())
    assert not path.exists()


def test_the_model_fits_its_own_export(exported, model):
    problem = Problem(merl.read(exported), phi_group=9)
    assert problem.objective_of(model) < 1e-3


def test_the_verb(tmp_path, model, capsys):
    params, output = tmp_path / "paint.nfm.json", tmp_path / "out.binary"
    parameter_file.save(params, FittedMaterial("paint", model))
    assert main(["export", str(params), "-o", str(output)]) == 0
    assert str(output) in capsys.readouterr().out
    assert output.stat().st_size == merl.FILE_SIZE


@pytest.mark.parametrize("name", ["out.exr", "out", "out.binary.txt"])
def test_other_suffixes_are_refused(tmp_path, model, capsys, name):
    params, output = tmp_path / "paint.nfm.json", tmp_path / name
    parameter_file.save(params, FittedMaterial("paint", model))
    assert main(["export", str(params), "-o", str(output)]) == FAILED
    assert "let it end in .binary or .bin" in capsys.readouterr().err
    assert not output.exists()


def test_folder_that_is_missing(tmp_path, model, capsys):
    params = tmp_path / "paint.nfm.json"
    parameter_file.save(params, FittedMaterial("paint", model))
    assert main(["export", str(params), "-o", str(tmp_path / "none" / "a.binary")]) == FAILED
    assert "a.binary: cannot be written" in capsys.readouterr().err
