import os

import pytest

from runner import __main__ as runner
from runner.messages import SetupError
from runner.verbs import VERBS


@pytest.fixture
def prepared(monkeypatch):
    """Skip the environment; collect what would be executed."""
    executed = []
    monkeypatch.setattr(runner, "_prepare", lambda verb, arguments: "/env/python")
    monkeypatch.setattr(os, "execv", lambda path, argv: executed.append((path, argv)))
    return executed


def test_help_lists_every_verb(capsys):
    assert runner.main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert all(f"\n  {name} " in listed for name in VERBS)


def test_no_verb_is_bad_usage(capsys):
    assert runner.main([]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("usage: ./nfm")


def test_unknown_verb_is_bad_usage(prepared, capsys):
    assert runner.main(["frobnicate"]) == 2
    assert prepared == []
    assert "frobnicate" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("verb", "target"),
    [
        ("fit", ["fitter", "fit"]),
        ("eval", ["runner.blender", "eval"]),
        ("render", ["runner.blender", "render"]),
        ("demo", ["runner.blender", "demo"]),
        ("compare", ["compare"]),
        ("bench", ["benchmarks"]),
        ("test", ["runner.checks"]),
    ],
)
def test_verbs_run_their_module(prepared, verb, target):
    runner.main([verb, "a b", "--help"])
    ((path, argv),) = prepared
    assert path == "/env/python"
    assert argv == [path, "-P", "-m", "runner.interruptible", *target, "a b", "--help"]


def test_python_is_the_plain_interpreter(prepared):
    runner.main(["python", "-c", "pass"])
    assert prepared == [("/env/python", ["/env/python", "-c", "pass"])]


def test_verbs_that_do_without_blender():
    assert [n for n, verb in VERBS.items() if not verb.loads_blender] == ["fit", "fuzz"]


@pytest.mark.parametrize("option", [["--dask", "tcp://x"], ["--dask=tcp://x"]])
def test_options_bring_their_extras(option):
    assert VERBS["fit"].extras_for(["folder", *option]) == ("dask",)
    assert VERBS["fit"].extras_for(["folder"]) == ()
    assert VERBS["compare"].extras_for(["file"]) == ("report",)


@pytest.mark.parametrize("chosen", ["", "5.2"])
def test_the_demo_file_is_written_by_the_oldest_blender(prepared, monkeypatch, chosen):
    monkeypatch.setenv("NFM_BLENDER", chosen)
    runner.main(["demo", "--rebuild", "-o", "x"])
    path, argv = prepared[0]
    if chosen:
        assert path == "/env/python"
    else:
        assert path.name == "nfm"
        assert argv[1:] == ["--blender", "4.5", "demo", "--rebuild", "-o", "x"]
    assert VERBS["demo"].blender_for([]) is None


@pytest.mark.parametrize(
    ("error", "status"),
    [(SetupError("no"), 1), (PermissionError("no"), 1), (KeyboardInterrupt(), 130)],
)
def test_failed_preparation_has_a_status_and_no_traceback(monkeypatch, error, status):
    def fail(verb, arguments):
        raise error

    monkeypatch.setattr(runner, "_prepare", fail)
    assert runner.main(["fit"]) == status


def test_linear_algebra_has_one_thread_unless_the_user_wants_more(prepared, monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    runner.main(["test"])
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    runner.main(["test"])
    assert os.environ["OPENBLAS_NUM_THREADS"] == "3"
