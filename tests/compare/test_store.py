# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from compare import store
from compare.models import Settings
from compare.scenes import SceneSource
from compare.store import Store, result_key
from fitter.errors import NfmError

SCENE = SceneSource("a", np.ones((64, 128, 3)))


def test_round_trip(tmp_path, make_result):
    result = make_result()
    Store(tmp_path / "new" / "results").save("key", result)
    got = Store(tmp_path / "new" / "results").load("key")
    assert (got.name, got.sha256, got.grades) == (result.name, result.sha256, result.grades)
    for ours, theirs in zip(got.pictures, result.pictures, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(got.slices, result.slices)
    assert list(got.factors) == list(result.factors)
    for key, factors in result.factors.items():
        for name, array in vars(factors).items():
            np.testing.assert_array_equal(getattr(got.factors[key], name), array)


def test_what_is_not_there_or_damaged_is_none(tmp_path, make_result):
    kept = Store(tmp_path)
    assert kept.load("key") is None
    kept.save("key", make_result())
    path = tmp_path / "key.npz"
    whole = path.read_bytes()
    for damaged in (b"", b"PK", whole[: len(whole) // 2], whole[:-1] + b"x", b"x" * 1000):
        path.write_bytes(damaged)
        if damaged != whole[:-1] + b"x":
            assert kept.load("key") is None
    np.savez(path, about=np.array("{}"))
    assert kept.load("key") is None
    np.savez(path, about=np.array({"an": "object"}, dtype=object))
    assert kept.load("key") is None
    path.write_bytes(whole)
    assert kept.load("key") is not None


def test_folder_that_cannot_be_written(tmp_path, make_result):
    (tmp_path / "file").write_text("")
    with pytest.raises(NfmError, match=r"^results: cannot be written"):
        Store(tmp_path / "file" / "results").save("key", make_result())


def test_key_depends_on_all_that_matters(monkeypatch):
    other = SceneSource("a", 2 * np.ones((64, 128, 3)))
    keys = {
        result_key("sha", Settings("log"), [SCENE]),
        result_key("sha2", Settings("log"), [SCENE]),
        result_key("sha", Settings("linear"), [SCENE]),
        result_key("sha", Settings("log", golden_section=True), [SCENE]),
        result_key("sha", Settings("log", "draft"), [SCENE]),
        result_key("sha", Settings("log"), []),
        result_key("sha", Settings("log"), [other]),
        result_key("sha", Settings("log"), [SCENE, SCENE]),
    }
    assert len(keys) == 8
    assert result_key("sha", Settings("log"), [SCENE]) in keys
    monkeypatch.setattr(store, "code_version", lambda: "another")
    assert result_key("sha", Settings("log"), [SCENE]) not in keys


def test_version_is_that_of_the_code(tmp_path, monkeypatch):
    (tmp_path / "fitter").mkdir()
    (tmp_path / "compare").mkdir()
    monkeypatch.setattr(store, "CHECKOUT", tmp_path)
    for name in store.OWN_MODULES:
        assert (store.Path(store.__file__).parent / f"{name}.py").is_file()
        (tmp_path / "compare" / f"{name}.py").write_text("x = 1")
    (tmp_path / "compare" / "report.py").write_text("x = 1")
    fit = tmp_path / "fitter" / "fit.py"
    fit.write_text("x = 1")

    def version():
        return store.code_version.__wrapped__()

    first = version()
    assert version() == first
    (tmp_path / "compare" / "report.py").write_text("x = 2")
    assert version() == first
    fit.write_text("x = 2")
    second = version()
    (tmp_path / "compare" / "grading.py").write_text("x = 2")
    assert len({first, second, version()}) == 3
