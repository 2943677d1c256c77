"""The verbs inside Blender: eval, render, demo."""

import re

import numpy as np
import pytest

from fitter.formats import parameter_file
from runner.environment import CHECKOUT


@pytest.fixture
def main(addon):
    return addon("command_line").main


@pytest.fixture
def command(addon):
    return addon("command")


@pytest.fixture
def small_sphere(coarse_sphere):
    coarse_sphere(64)


@pytest.fixture
def render_verb(main, parameter_path, tmp_path, small_sphere):
    """Run render on the fitted material; options override the small defaults."""

    def run(*options, output=tmp_path / "out.exr"):
        small = ["--resolution", "16", "--samples", "2"]
        return main(["render", str(parameter_path), "-o", str(output), *small, *options])

    return run


def write_directions(path, count):
    rng = np.random.default_rng(count)
    pairs = rng.normal(size=(count, 2, 3))
    pairs[..., 2] = np.abs(pairs[..., 2]) + 0.01
    pairs /= np.linalg.norm(pairs, axis=-1, keepdims=True)
    np.save(path, pairs.reshape(count, 6))


# ---- eval ----


@pytest.mark.osl
# Blender renders no picture below 4 x 4: few pairs are a case of their own.
@pytest.mark.parametrize("count", [0, 1, 2, 5, 9, 10, 17, 500])
def test_eval_through_osl_equals_numpy(count, main, parameter_path, fitted, tmp_path):
    directions = tmp_path / "directions.npy"
    write_directions(directions, count)
    found = {}
    for through in ("numpy", "osl"):
        output = tmp_path / f"{through}.npy"
        options = ["--directions", str(directions), "-o", str(output), "--through", through]
        assert main(["eval", str(parameter_path), *options]) == 0
        found[through] = np.load(output)
    assert found["numpy"].shape == found["osl"].shape == (count, 3)
    np.testing.assert_allclose(found["osl"], found["numpy"], rtol=1e-4, atol=1e-6)
    pairs = np.load(directions).astype(np.float32).astype(float)
    np.testing.assert_allclose(found["numpy"], fitted.model.f_r(pairs[:, :3], pairs[:, 3:]))


def test_eval_goes_through_numpy_by_default(main, parameter_path, tmp_path, addon, monkeypatch):
    monkeypatch.delattr(addon("evaluate"), "_evaluate_chunk")
    directions, output = tmp_path / "directions.npy", tmp_path / "out.npy"
    write_directions(directions, 3)
    options = ["--directions", str(directions), "-o", str(output)]
    assert main(["eval", str(parameter_path), *options]) == 0
    assert output.exists()


# ---- render ----


@pytest.mark.osl
@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_render_writes_a_picture_and_one_line(suffix, render_verb, tmp_path, capsys):
    path = tmp_path / f"sphere{suffix}"
    assert render_verb(output=path) == 0
    assert path.exists()
    assert capsys.readouterr().out == f"written to      {path}\n"


@pytest.mark.osl
def test_render_shows_cloths(render_verb, addon, monkeypatch, tmp_path):
    for name, value in (("LEVELS", (9, 17)), ("STEPS", (40, 20)), ("PARTICLES", 17)):
        monkeypatch.setattr(addon("drape"), name, value)
    path = tmp_path / "cloths.exr"
    assert render_verb("--scene", "cloth", output=path) == 0
    assert addon("images").read_linear(path).shape == (16, 48, 3)


@pytest.mark.osl
def test_render_options_reach_the_picture(render_verb, addon, tmp_path):
    read = addon("images").read_linear
    light = tmp_path / "light.exr"
    addon("images").write_linear(light, np.full((4, 8, 3), 0.25))
    pictures = {}
    for name, options in {
        "plain": [],
        "again": [],
        "seed": ["--seed", "5"],
        "env": ["--env", str(light)],
        "samples": ["--samples", "64"],
        "cosine": ["--sampling", "cosine"],
        "exact": ["--sampling", "exact"],
        "candidates": ["--sampling", "exact", "--candidates", "5"],
        "points": ["--point-sampled"],
        "large": ["--resolution", "20"],
    }.items():
        path = tmp_path / f"{name}.exr"
        assert render_verb(*options, output=path) == 0
        pictures[name] = read(path)
    plain = pictures.pop("plain")
    assert plain.shape == (16, 16, 3)
    assert pictures.pop("large").shape == (20, 20, 3)
    np.testing.assert_array_equal(pictures.pop("again"), plain)
    for name, picture in pictures.items():
        assert (picture != plain).any(), name
    assert (pictures["candidates"] != pictures["exact"]).any()
    assert (plain[0, 0] == 1).all()
    assert (pictures["env"][0, 0] == 0.25).all()
    # rays through the centres: a pixel at the rim is the sphere or the world, no mixture
    axis = ((np.arange(16) + 0.5) / 16 - 0.5) * 2.2
    outside = np.hypot(axis[:, None], axis) > 1.001
    assert (pictures["points"][outside] == 1).all()
    assert (plain[outside] != 1).any()


@pytest.mark.parametrize(
    "options",
    [
        ["--samples", "0"],
        ["--samples", "many"],
        ["--samples", "1.5"],
        ["--samples", "1000000000000"],
        ["--seed", "-1"],
        ["--seed", "2147483648"],
        ["--resolution", "3"],  # Blender would make it 4
        ["--resolution", "1000000000000"],
        ["--candidates", "0"],
        ["--candidates", "64"],  # one closure too many
        ["--sampling", "REFERENCE"],
        ["--no-such-option"],
    ],
    ids=" ".join,
)
def test_bad_usage_exits_with_2(options, render_verb, tmp_path, capsys):
    with pytest.raises(SystemExit) as exit_:
        render_verb(*options)
    assert exit_.value.code == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert "error: " in answer.err
    assert "_" not in answer.err.rpartition("error: ")[2]  # no name of a function of ours
    assert not (tmp_path / "out.exr").exists()


@pytest.mark.parametrize("arguments", [[], ["paint"], ["render"], ["eval"]])
def test_missing_arguments_exit_with_2(arguments, main, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    assert "usage: nfm" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--env", "none.hdr"], "nfm: none.hdr: no such image; check the path\n"),
        (["-o", "none/out.png"], "nfm: out.png: its folder does not exist"),
        (["-o", "out.jpg"], "nfm: out.jpg: cannot write .jpg; use .exr or .png\n"),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_unusable_files_fail_with_one_line(options, message, render_verb, tmp_path, capfd):
    path = str(tmp_path / options[-1])
    assert render_verb(options[0], path) == 1
    answer = capfd.readouterr()
    assert answer.out == ""
    assert answer.err.startswith(message)
    assert answer.err.count("\n") == 1


@pytest.mark.parametrize("verb", ["render", "demo", "eval"])
@pytest.mark.parametrize("name", ["none.binary", "none.nfm.json"])
def test_missing_file_fails_with_one_line(verb, name, main, tmp_path, capfd):
    directions = tmp_path / "directions.npy"
    write_directions(directions, 1)
    options = ["--directions", str(directions)] if verb == "eval" else []
    output = tmp_path / ("demo" if verb == "demo" else "out.exr")
    assert main([verb, str(tmp_path / name), *options, "-o", str(output)]) == 1
    assert capfd.readouterr() == ("", f"nfm: {name}: no such file; check the path\n")


# ---- demo ----


@pytest.fixture
def small_demo(addon, monkeypatch, small_sphere):
    """The demo's picture, small."""
    module = addon("command_line")
    view = module.SphereView

    def small(**options):
        return view(**{**options, "resolution": 16, "samples": 1})

    monkeypatch.setattr(module, "SphereView", small)


@pytest.mark.osl
def test_demo_of_a_given_file_prints_its_picture(
    main, small_demo, parameter_path, native_error, tmp_path, capsys
):
    folder = tmp_path / "new" / "demo"
    assert main(["demo", str(parameter_path), "-o", str(folder)]) == 0
    report = capsys.readouterr().out
    assert "synthetic" not in report
    assert re.search(r"^material +blue plastic$", report, re.M)
    assert f"\nnative sampling {native_error.image:.2%} error of a picture in a studio\n" in report
    assert f"\n{'':<16}{native_error.psnr:.1f} dB against the model\n" in report
    path = folder / "blue.nfm.png"
    assert report.endswith(f"\nThe picture is {path}\n")
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.osl
def test_demo_without_a_file_says_that_it_is_synthetic(
    main, addon, small_demo, fitted, tmp_path, capsys, monkeypatch
):
    given = []
    monkeypatch.setattr(addon("command_line"), "_fitted", lambda p, _: given.append(p) or fitted)
    assert main(["demo", "-o", str(tmp_path)]) == 0
    (sample,) = given
    assert sample.parent == tmp_path
    assert sample.stat().st_size == 34_992_012
    assert f"{sample} is a synthetic sample" in capsys.readouterr().out
    assert sample.with_suffix(".png").exists()


def test_demo_into_a_file_fails_with_one_line(main, parameter_path, capfd):
    assert main(["demo", str(parameter_path), "-o", str(parameter_path)]) == 1
    answer = capfd.readouterr()
    assert answer.err.startswith("nfm: blue.nfm.json: cannot be made a folder (File exists)")
    assert answer.err.count("\n") == 1
    parameter_file.load(parameter_path)


# ---- as a process, and as a Blender command ----


@pytest.mark.osl
def test_process_prints_the_report_and_nothing_of_blender(run_python, parameter_path, tmp_path):
    path = tmp_path / "out.png"
    code = "from runner.blender import main; sys.exit(main(sys.argv[1:]))"
    options = ["--resolution", "8", "--samples", "1", "-o", path]
    with_checkout = f"sys.path.insert(0, {str(CHECKOUT)!r}); {code}"
    answer = run_python(with_checkout, "render", parameter_path, *options, blender=False)
    assert answer == f"written to      {path}\n"


# The bpy module reads no command line: `--command nfm` works in a full Blender only. Here we can
# see that Blender knows the command, and call what it would call.


def test_command_is_registered(blender, command):
    blender.utils.unregister_cli_command(command._handle)
    try:
        # the handle was alive, and only once
        with pytest.raises(ValueError, match="already been removed"):
            blender.utils.unregister_cli_command(command._handle)
    finally:
        command.register()


def test_command_runs_the_verbs(blender, command, parameter_path, tmp_path, monkeypatch):
    registered = {}
    monkeypatch.setattr(command, "_handle", command._handle)
    monkeypatch.setattr(blender.utils, "register_cli_command", registered.__setitem__)
    command.register()
    assert list(registered) == ["nfm"]
    directions, output = tmp_path / "directions.npy", tmp_path / "out.npy"
    write_directions(directions, 4)
    arguments = ["eval", str(parameter_path), "--directions", str(directions), "-o", str(output)]
    assert registered["nfm"](arguments) == 0
    assert np.load(output).shape == (4, 3)
    assert registered["nfm"](["eval", "none.nfm.json", *arguments[2:]]) == 1
