# SPDX-License-Identifier: GPL-3.0-or-later
import json
import time
from pathlib import Path

import numpy as np
import pytest

from fitter import command_line, synthetic
from fitter.command_line import main, read_directions
from fitter.fitting import quality
from fitter.formats import parameter_file
from fitter.formats.parameter_file import FittedMaterial
from fitter.shading.base_error import base_error
from fitter.shading.base_lobes import fit_base_lobes


@pytest.fixture
def params(tmp_path, random_model):
    path = tmp_path / "gold.nfm.json"
    parameter_file.save(path, FittedMaterial("gold", random_model(0)))
    return path


def one_line(capsys, file_name):
    """The whole of what a failure says."""
    out, err = capsys.readouterr()
    assert out == ""
    last = err.splitlines()[-1]
    assert last.startswith("nfm: ")
    assert file_name in last
    assert "Traceback" not in err
    assert len(err.splitlines()) == 1


# --- fit ---


def test_fit_writes_and_reports(short_fit, measured, tmp_path, capsys):
    output = tmp_path / "out.nfm.json"
    start = time.perf_counter()
    assert main(["fit", str(measured), "-o", str(output)]) == 0
    seconds = time.perf_counter() - start
    out, err = capsys.readouterr()
    material = parameter_file.load(output)
    assert material.name == "copper"
    rows = dict(line.split(None, 1) for line in out.splitlines())
    assert rows["material"] == "copper"
    assert rows["objective"].startswith(f"{material.fit['objective']:.3e}")
    assert rows["iterations"] == str(material.fit["iterations"])
    assert 0 < float(rows["seconds"]) < seconds + 0.05  # rounded
    assert f"log error  {material.fit['mean_log_error']:.4f}" in out
    assert f"{material.fit['largest_directional_albedo']:.3f}" in out
    native = base_error(material.model, fit_base_lobes(material.model))
    assert 0 < native.image < native.directional
    assert f"\nnative sampling {native.image:.2%} error of a picture in a studio\n" in out
    assert f"\n{'':<16}{native.psnr:.1f} dB against the model\n" in out
    assert f"\n{'':<16}{native.directional:.2%} error over all directions\n" in out
    assert str(output) in out
    explored = [f"{stage} {n}" for n in (1, 2, 3) for stage in ("sweep", "explore")]
    lines = err.splitlines()
    assert lines[:6] == [f"fit: {stage}" for stage in explored]
    assert lines[8:] == ["fit: refine", "fit: appearance", "fit: polish"]
    assert len({"fit: final 1", "fit: final 2", "fit: final 3"} & {*lines[6:8]}) == 2
    assert list(tmp_path.iterdir()) == [output]


def test_fit_report_for_machines(short_fit, measured, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--weight", "log1p", "--quality", "draft", "--prior", "0.05"]
    assert main(["fit", str(measured), "--json", *options]) == 0
    report = json.loads(capsys.readouterr().out)
    material = parameter_file.load(tmp_path / "copper.nfm.json")  # the name of the file, here
    assert report.pop("output") == "copper.nfm.json"
    assert report.pop("seconds") > 0
    assert report.pop("cpu_seconds") > 0
    native = base_error(material.model, fit_base_lobes(material.model))
    assert report.pop("native_error") == pytest.approx(native.image, rel=1e-9)
    assert report.pop("native_directional_error") == pytest.approx(native.directional, rel=1e-9)
    assert report.pop("native_psnr") == pytest.approx(native.psnr, rel=1e-9)
    assert report == material.fit
    assert [report[key] for key in ("weight", "quality", "prior_strength")] == [
        "log1p",
        "draft",
        0.05,
    ]


@pytest.fixture
def short_anisotropic_fit(monkeypatch):
    for name in quality.ANISOTROPIC_QUALITIES:
        monkeypatch.setitem(quality.ANISOTROPIC_QUALITIES, name, quality.Work(1, 2, 0, 1, 0, 2))


def test_fit_of_an_anisotropic_file(short_anisotropic_fit, tmp_path, capsys):
    measured, output = tmp_path / "silk.bin", tmp_path / "silk.nfm.json"
    synthetic.write_sample(measured, "shot-silk")
    options = ["-o", str(output), "--encoding", "srgb-140"]
    assert main(["fit", str(measured), *options]) == 0
    out, _ = capsys.readouterr()
    rows = dict(line.split(None, 1) for line in out.splitlines())
    assert rows["model"] == "3 lobes, 2010 numbers"
    assert rows["encoding"] == "srgb-140"
    material = parameter_file.load(output)
    assert f"{material.fit['anisotropy_direction']:.1f} degrees" in out
    assert f"{material.fit['numeric_psnr']:.1f} dB over the data" in out
    # and it can be evaluated
    pairs = np.array([[0, 0, 1, 0.6, 0, 0.8], [0.6, 0, 0.8, 0, 0.6, 0.8]])
    np.save(tmp_path / "pairs.npy", pairs)
    values = tmp_path / "values.npy"
    arguments = ["--directions", str(tmp_path / "pairs.npy"), "-o", str(values)]
    assert main(["eval", str(output), *arguments]) == 0
    rounded = pairs.astype(np.float32).astype(float)
    expected = material.model.f_r(rounded[:, :3], rounded[:, 3:])
    np.testing.assert_array_equal(np.load(values), expected)


def test_encoding_of_an_isotropic_file(measured, tmp_path, capsys):
    output = tmp_path / "out.nfm.json"
    assert main(["fit", str(measured), "-o", str(output), "--encoding", "linear"]) == 1
    one_line(capsys, "copper.binary")
    assert not output.exists()


def test_fit_of_a_missing_file(tmp_path, capsys):
    output = tmp_path / "out.nfm.json"
    assert main(["fit", str(tmp_path / "nope.binary"), "-o", str(output)]) == 1
    one_line(capsys, "nope.binary")
    assert list(tmp_path.iterdir()) == []


def test_fit_of_something_else(tmp_path, capsys):
    path = tmp_path / "text.binary"
    path.write_text("hello")
    assert main(["fit", str(path), "-o", str(tmp_path / "out.nfm.json")]) == 1
    one_line(capsys, "text.binary")
    assert list(tmp_path.iterdir()) == [path]


def test_fit_to_a_folder_that_is_missing_fails_before_the_work(
    measured, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(command_line, "fit_measurement", None)  # would raise if it got there
    assert main(["fit", str(measured), "-o", str(tmp_path / "no" / "out.nfm.json")]) == 1
    one_line(capsys, "out.nfm.json: there is no such folder")
    assert list(tmp_path.iterdir()) == []


def test_fit_to_a_path_that_is_a_folder(measured, tmp_path, capsys, monkeypatch, random_model):
    fitted = FittedMaterial("copper", random_model(0))
    monkeypatch.setattr(command_line, "fit_measurement", lambda *_, **__: fitted)
    folder = tmp_path / "folder"
    folder.mkdir()
    assert main(["fit", str(measured), "-o", str(folder)]) == 1
    one_line(capsys, "folder: cannot be written")
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["fit"],
        ["fly"],
        ["fit", "x", "--weight", "heavy"],
        ["fit", "x", "--model", "other"],
        ["fit", "x", "--quality", "perfect"],
        ["fit", "x", "--prior", "-1"],
        ["fit", "x", "--prior", "nan"],
        ["fit", "x", "--prior", "much"],
        ["fit", "x", "y"],
        ["eval", "x"],
        ["eval", "x", "--directions", "y"],
    ],
)
def test_bad_usage(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "usage: nfm" in capsys.readouterr().err


# --- eval ---


def pairs(upper_directions, n=500):
    rng = np.random.default_rng(0)
    rows = np.concatenate([upper_directions(rng, n), upper_directions(rng, n)], axis=1)
    rows[0, 2] *= -1  # below the horizon counts too
    return rows


@pytest.mark.parametrize("dtype", ["<f8", ">f8", "<f4"])
def test_eval(params, tmp_path, upper_directions, dtype):
    rows = pairs(upper_directions).astype(dtype)
    np.save(tmp_path / "in.npy", rows)
    output = tmp_path / "out.npy"
    assert (
        main(["eval", str(params), "--directions", str(tmp_path / "in.npy"), "-o", str(output)])
        == 0
    )
    got = np.load(output)
    model = parameter_file.load(params).model
    # directions are rounded to single precision, as a renderer has them
    rows = rows.astype(np.float32).astype(np.float64)
    # to the last digits, which depend on how the rows lie in memory
    np.testing.assert_allclose(got, model.f_r(rows[:, :3], rows[:, 3:]), rtol=1e-11)
    np.testing.assert_array_equal(got[0], 0)
    assert got.shape == (500, 3)


def test_eval_of_integers_and_of_nothing(params, tmp_path):
    output = tmp_path / "out.npy"
    arguments = ["eval", str(params), "--directions", str(tmp_path / "in.npy"), "-o", str(output)]
    np.save(tmp_path / "in.npy", np.array([[0, 0, 1, 0, 0, 1]]))
    assert main(arguments) == 0
    assert np.load(output).shape == (1, 3)
    np.save(tmp_path / "in.npy", np.zeros((0, 6)))
    assert main(arguments) == 0
    assert np.load(output).shape == (0, 3)


def npy(header):
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


BAD_BYTES = {
    "empty": b"",
    "text": b"0 0 1 0 0 1\n",
    "newline": b"\n",
    "zip": b"PK\x03\x04 and then nothing",
    "pickle": b"\x80\x04K\x01.",
    "version": b"\x93NUMPY\x09\x00\x10\x00{}",
    "short header": b"\x93NUMPY\x01\x00\xff\xff{",
    "no literal": npy("{'descr': open('x'), 'fortran_order': False, 'shape': (1, 6)}"),
    "unfinished": npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 6"),
    "null": npy("{'descr': '<f8', \0 'fortran_order': False, 'shape': (1, 6)}"),
    "nested": npy("(" * 9000),
    "nested signs": npy("-" * 9000 + "1"),
    "python 2": npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1L, '''"),
    "too few": npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 6), }") + b"\0" * 48,
    "too many": npy("{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000000, 6), }"),
    "far too many": npy("{'descr': '<f8', 'fortran_order': False, 'shape': (9" + "0" * 30 + ",)}"),
    "bad type": npy("{'descr': 'qq', 'fortran_order': False, 'shape': (1, 6), }"),
    "odd type": npy("{'descr': ('<f8', 3, 4, 5), 'fortran_order': False, 'shape': (1, 6), }"),
}  # fmt: skip


def up(n=4):
    return np.tile([0.0, 0, 1, 0, 0, 1], (n, 1))


BAD_ARRAYS = {
    "pickled": np.array([[None] * 6]),
    "one axis": up()[0],
    "three axes": up()[None],
    "five columns": up()[:, :5],
    "scalar": np.float64(1),
    "complex": up().astype(complex),
    "text": np.array([["a"] * 6]),
    "booleans": up().astype(bool),
    "records": np.zeros((2, 6), [("a", "f8")]),
    "nan": np.where(np.arange(24).reshape(4, 6) == 9, np.nan, up()),
    "infinite": np.where(np.arange(24).reshape(4, 6) == 9, np.inf, up()),
    "half as long": up() / 2,
    "beyond single precision": up() * 1e200,
    "one of them long": up() * [1, 1, 1, 1, 1, 1.01],
    "zero": np.zeros((1, 6)),
}


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("bad", [*BAD_BYTES, *BAD_ARRAYS])
def test_eval_refuses(params, tmp_path, capsys, bad):
    path = tmp_path / "in.npy"
    if bad in BAD_BYTES:
        path.write_bytes(BAD_BYTES[bad])
    else:
        np.save(path, BAD_ARRAYS[bad], allow_pickle=True)
    arguments = ["eval", str(params), "--directions", str(path), "-o", str(tmp_path / "out.npy")]
    assert main(arguments) == 1
    one_line(capsys, "in.npy")
    assert not (tmp_path / "out.npy").exists()


class Intruder:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return Path.mkdir, (self.folder,)


def test_eval_executes_nothing(params, tmp_path, capsys):
    array = np.empty((1, 6), object)
    array[:] = Intruder(tmp_path / "broken in")
    np.save(tmp_path / "in.npy", array, allow_pickle=True)
    path = str(tmp_path / "in.npy")
    assert main(["eval", str(params), "--directions", path, "-o", str(tmp_path / "out.npy")]) == 1
    one_line(capsys, "in.npy")
    assert not (tmp_path / "broken in").exists()


def test_light_comes_first_in_a_row(tmp_path):
    np.save(tmp_path / "in.npy", [[0, 0, 1, 0.6, 0, 0.8], [0.6, 0, 0.8, 0, 1, 0]])
    wi, wo = read_directions(tmp_path / "in.npy")
    np.testing.assert_allclose(wi, [[0, 0, 1], [0.6, 0, 0.8]], atol=1e-7)
    np.testing.assert_allclose(wo, [[0.6, 0, 0.8], [0, 1, 0]], atol=1e-7)


def test_eval_refuses_several_arrays_in_one_file(params, tmp_path, capsys):
    np.savez(tmp_path / "in.npz", a=up())
    path = str(tmp_path / "in.npz")
    assert main(["eval", str(params), "--directions", path, "-o", str(tmp_path / "out.npy")]) == 1
    one_line(capsys, "in.npz")


def test_eval_names_the_first_bad_row(params, tmp_path, capsys):
    rows = up()
    rows[2:, 2] = 0.9
    np.save(tmp_path / "in.npy", rows)
    path = str(tmp_path / "in.npy")
    assert main(["eval", str(params), "--directions", path, "-o", str(tmp_path / "out.npy")]) == 1
    assert "row 2 " in capsys.readouterr().err


def test_eval_without_files(params, tmp_path, capsys):
    np.save(tmp_path / "in.npy", up())
    output = str(tmp_path / "out.npy")
    here, nowhere = str(tmp_path / "in.npy"), str(tmp_path / "no.npy")
    assert main(["eval", str(params), "--directions", nowhere, "-o", output]) == 1
    one_line(capsys, "no.npy")
    assert main(["eval", nowhere, "--directions", here, "-o", output]) == 1
    one_line(capsys, "no.npy")
    assert main(["eval", str(params), "--directions", here, "-o", str(tmp_path)]) == 1
    one_line(capsys, tmp_path.name)
    missing = str(tmp_path / "no" / "out.npy")
    assert main(["eval", str(params), "--directions", here, "-o", missing]) == 1
    one_line(capsys, "out.npy")
    assert not (tmp_path / "out.npy").exists()
