"""Fixtures of all tests."""

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from fitter import geometry, synthetic
from fitter.formats import merl
from fitter.measurement import BinReport, Measurement, Source
from fitter.shading import shading
from runner import blender as loader
from runner.environment import CHECKOUT
from tests import bases

# At import: a test module that imports bpy is collected before any fixture runs.
loader.use_scratch_settings()

STATUS = pytest.StashKey[int]()


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Keep the status for the end."""
    session.config.stash[STATUS] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config: pytest.Config) -> None:
    """Everything is reported: end as a process with Blender in it has to."""
    if "bpy" in sys.modules:
        loader.leave(config.stash[STATUS])


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what the marks `osl` and `module` are on where that is not there.

    The mark `one_version` is not for tests to which it matters which Blender runs them.
    """
    if item.get_closest_marker("one_version"):
        assert "extension" not in item.fixturenames, "runs in Blender, so in every version of it"
    if importlib.util.find_spec("bpy") is None:
        return
    if item.get_closest_marker("osl") and not _has_osl():
        pytest.skip("this Blender was built without Open Shading Language")
    if item.get_closest_marker("module") and not _is_module():
        pytest.skip("needs Blender as a Python module, which ./nfm test has")


def _has_osl() -> bool:
    import bpy  # noqa: F401, without it there is no _cycles

    return importlib.import_module("_cycles").with_osl


def _is_module() -> bool:
    import bpy

    return bpy.app.module


@pytest.fixture(scope="session")
def extension(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """The root module of the checkout, enabled in Blender as an extension.

    It fits the base lobes and writes the shader of equal models once: many tests import the same
    material. Base lobes of the models that tests share are those that tests of the fitter have.
    """
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("bpy is not installed")
    root = loader.load_extension()
    folder = tmp_path_factory.mktemp("bases")
    with pytest.MonkeyPatch.context() as patch:
        own = importlib.import_module(f"{root.__name__}.nfm_addon.shader_source")
        patch.setattr(own, "shade", from_the_fitter_s_tests(root, own.shade, folder))
        for module, name in (("shader_source", "shade"), ("material", "new_surface")):
            owner = importlib.import_module(f"{root.__name__}.nfm_addon.{module}")
            patch.setattr(owner, name, once_for_each_model(getattr(owner, name)))
        yield root


def once_for_each_model(function: Callable) -> Callable:
    """The function with a memory: of models by their numbers, whichever object holds them."""
    answers = {}

    def remembered(model: object, *arguments: object, **options: object) -> object:
        if options.get("draft"):  # which there is none of where base lobes are known
            return function(model, *arguments, **options)
        key = (type(model), *numbers_of(model), *arguments, *options.items())
        if key not in answers:
            answers[key] = function(model, *arguments, **options)
        return answers[key]

    return remembered


def numbers_of(model: object) -> tuple[bytes, ...]:
    """What tells models apart, whichever object holds them."""
    return tuple(getattr(model, field.name).tobytes() for field in fields(model))


def from_the_fitter_s_tests(root: ModuleType, shade: Callable, folder: Path) -> Callable:
    """The extension's shade, which takes what tests/bases.py has as from the fitter's process."""
    own = importlib.import_module(f"{root.__name__}.fitter.shading.shading")
    names = {numbers_of(model): name for name, model in bases.ALL_MODELS.items()}

    def found(model: object, **options: object) -> object:
        name = names.get(numbers_of(model))
        if name is None or options:
            return shade(model, **options)
        shading.save(folder / f"{name}.npz", bases.shading_of(name))
        return own.load(folder / f"{name}.npz")

    return found


@pytest.fixture
def blender(extension: ModuleType) -> ModuleType:
    """The bpy module, in an empty scene with factory settings and the extension enabled."""
    import bpy

    # Not read_factory_settings: that disables the extension.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return bpy


@pytest.fixture
def addon(extension: ModuleType, blender: ModuleType) -> Callable[[str], ModuleType]:
    """Import a module of the add-on as Blender sees it: addon("material")."""

    def load(name: str) -> ModuleType:
        return importlib.import_module(f"{extension.__name__}.nfm_addon.{name}")

    return load


@pytest.fixture
def coarse_sphere(
    addon: Callable[[str], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> Callable[[int], ModuleType]:
    """Give the standard sphere so many segments; its module.

    The whole mesh is most of the time of a small picture. With 256 segments the normal between
    vertices is off by less than 4e-5.
    """

    def set_to(segments: int) -> ModuleType:
        module = addon("standard_sphere")
        monkeypatch.setattr(module, "SEGMENTS", segments)
        monkeypatch.setattr(module, "RINGS", segments // 2)
        return module

    return set_to


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared measurements and tools beside the checkout."""
    folder = CHECKOUT.parent / "shared"
    if not folder.is_dir():
        pytest.skip(f"there is no {folder}")
    return folder


@pytest.fixture(scope="session")
def make_measurement():
    """Measurement of a table (90, 90, 180, 3); bins outside `valid` count as negative."""

    def make(f_r, valid=None):
        above = geometry.merl_bins().above_horizon
        valid = above if valid is None else valid & above
        missing = int((above & ~valid).sum())
        return Measurement(
            f_r=np.where(valid[..., None], f_r, 0),
            valid=valid,
            source=Source("planted.binary", "merl", "0" * 64),
            report=BinReport(valid.size, int((~above).sum()), missing, 0),
        )

    return make


@pytest.fixture(scope="session")
def two_lobes(make_measurement):
    """A clear coat over flakes and a diffuse base."""
    return make_measurement(*synthetic.tabulate(synthetic.SAMPLES["copper-paint"]))


@pytest.fixture(scope="session")
def measured(tmp_path_factory, two_lobes):
    """The same as a MERL file, which tests leave as it is."""
    path = tmp_path_factory.mktemp("measured") / "copper.binary"
    merl.write(path, two_lobes.f_r, two_lobes.valid)
    yield path
    path.unlink()
