# SPDX-License-Identifier: GPL-3.0-or-later
import tracemalloc
from functools import partial

import numpy as np
import pytest

from fitter.errors import MeasurementError
from fitter.formats import readers, rgl
from fitter.formats.cie1931 import srgb_from_reflectance
from tests import rgl_files

SHARED = (
    "aurora_white",
    "cc_green_malachite",
    "cc_iris_purple_gem",
    "cc_nothern_aurora",
    "cg_sunflower",
    "chm_light_blue",
    "chm_mint",
    "chm_orange",
    "cm_military_green",
    "colodur_napoli_4f",
    "irid_flake_paint1_fine",
    "vch_silk_blue",
)
CIRCLE = np.linspace(-np.pi, np.pi, 9)
QUARTER = np.linspace(-np.pi, -np.pi / 2, 4)


@pytest.fixture(scope="session")
def fields():
    """A small isotropic file."""
    return rgl_files.fields_of(rgl_files.glossy, n=8, n_theta=3)


def written(folder, fields, name="a.bsdf"):
    path = folder / name
    path.write_bytes(rgl_files.tensor_bytes(fields))
    return path


def pairs_of(n, seed=0):
    """All directions alike, down to the horizon."""
    rng = np.random.default_rng(seed)
    z, phi = rng.random((2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), z], -1)


def mitsuba_values(path, incident, exitant, variant="scalar_rgb", wavelengths=None):
    """f_r cos theta_o (n, 3) of the plugin `measured`; spectral: (n, 4) at four wavelengths."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant(variant)
    bsdf = mitsuba.load_dict({"type": "measured", "filename": str(path)})
    interaction, context = mitsuba.SurfaceInteraction3f(), mitsuba.BSDFContext()
    if wavelengths is not None:
        interaction.wavelengths = wavelengths
    values = []
    for wi, wo in zip(incident, exitant, strict=True):
        interaction.wi = wi
        values.append(bsdf.eval(context, interaction, wo))
    return np.array(values)


def assert_close_to_mitsuba(ours, theirs):
    error = np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1e-6)
    assert np.median(error) < 1e-3
    assert np.percentile(error, 99) < 1e-2


@pytest.mark.parametrize("name", SHARED)
def test_shared_files_against_mitsuba(shared, name):
    path = shared / "data" / "rgl" / f"{name}_rgb.bsdf"
    pairs = pairs_of(10_000)
    theirs = mitsuba_values(path, *pairs)
    assert_close_to_mitsuba(rgl.load(path).brdf.f_r(*pairs) * pairs[1][:, 2:], theirs)


@pytest.mark.parametrize("phi_i", [(0.0,), (0.0, 1.0), CIRCLE, QUARTER])
@pytest.mark.parametrize("jacobian", [True, False])
def test_own_files_against_mitsuba(tmp_path, phi_i, jacobian):
    made = rgl_files.fields_of(rgl_files.glossy, phi_i, jacobian=jacobian, n=8, n_theta=5)
    path = written(tmp_path, made)
    pairs = pairs_of(2000)
    theirs = mitsuba_values(path, *pairs)
    assert_close_to_mitsuba(rgl.load(path).brdf.f_r(*pairs) * pairs[1][:, 2:], theirs)


def test_spectral_file_against_mitsuba(tmp_path):
    """Mitsuba's spectra at all wavelengths of the file, turned to colours, are ours."""
    made = rgl_files.fields_of(rgl_files.glossy, spectral=True, n=8, n_theta=5)
    path = written(tmp_path, made)
    pairs = pairs_of(500)
    spectra = [
        mitsuba_values(path, *pairs, "scalar_spectral", made["wavelengths"][start : start + 4])
        for start in range(0, 16, 4)
    ]
    theirs = np.concatenate(spectra, axis=1) @ srgb_from_reflectance(made["wavelengths"]).T
    assert_close_to_mitsuba(rgl.load(path).brdf.f_r(*pairs) * pairs[1][:, 2:], theirs)


def test_read_gives_a_measurement(tmp_path, fields):
    path = written(tmp_path, fields, "pearl_rgb.bsdf")
    measurement = rgl.read(path)
    assert measurement.source.format == "rgl"
    assert measurement.source.file_name == "pearl_rgb.bsdf"
    assert len(measurement.source.sha256) == 64
    wi, wo = (pair[(pair[:, 2] > 0.1)][:500] for pair in pairs_of(1000))
    brdf = rgl.load(path).brdf
    wanted = (brdf.f_r(wi, wo) + brdf.f_r(wo, wi)) / 2
    found = measurement.lookup(wi, wo)
    assert np.median(np.abs(found / wanted - 1)) < 0.02


@pytest.mark.parametrize("name", ["a.bsdf", "a.binary", "a"])
def test_recognised_by_content(tmp_path, fields, name):
    assert readers.detect(written(tmp_path, fields, name)).name == "rgl"


def test_recognised_by_suffix(tmp_path):
    path = tmp_path / "a.bsdf"
    path.write_bytes(b"not found")
    with pytest.raises(MeasurementError, match=r"^a\.bsdf: does not begin as a tensor file"):
        readers.read(path)


def test_negative_channels_are_set_to_zero_and_counted(tmp_path, fields):
    rgb = fields["rgb"].copy()
    rgb[:, :, 2, :4] = -0.1
    measurement = rgl.read(written(tmp_path, {**fields, "rgb": rgb}))
    assert (measurement.f_r >= 0).all()
    assert 0 < measurement.report.clamped < measurement.report.usable
    assert measurement.report.negative == 0
    untouched = rgl.read(written(tmp_path, fields)).report
    assert untouched.clamped == 0
    assert untouched.usable == measurement.report.usable


def test_bins_without_numbers_are_masked(tmp_path, fields):
    rgb = fields["rgb"].copy()
    rgb[:, 0, 1, 3, 3] = np.nan
    rgb[:, 1, 1, 3, 3] = np.inf
    measurement = rgl.read(written(tmp_path, {**fields, "rgb": rgb}))
    assert np.isfinite(measurement.f_r).all()
    assert 0 < measurement.report.non_finite < measurement.report.usable
    assert measurement.report.usable == measurement.valid.sum()


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_nothing_to_fit(tmp_path, fields, value):
    path = written(tmp_path, {**fields, "rgb": np.full_like(fields["rgb"], value)})
    with pytest.raises(MeasurementError, match=r"^a\.bsdf: .*download it again"):
        rgl.read(path)


def test_anisotropic_file_is_tabulated_on_the_utia_grid(tmp_path):
    brush = partial(rgl_files.glossy, alpha=(0.3, 0.6))
    path = written(tmp_path, rgl_files.fields_of(brush, QUARTER, n=8, n_theta=5))
    measurement = rgl.read(path)
    assert measurement.f_r.shape == (6, 48, 6, 48, 3)
    assert measurement.valid.all()
    assert measurement.source.format == "rgl"
    assert measurement.report.negative == measurement.report.non_finite == 0
    np.testing.assert_allclose(measurement.f_r, measurement.f_r.transpose(2, 3, 0, 1, 4))
    # at 45 degrees: light along the brush and across it, seen from above
    brdf = rgl.load(path).brdf
    above = np.array([[0.0, 0, 1]])
    for phi, node in ((0.0, 0), (np.pi / 2, 12)):
        wi = rgl_files.spherical(np.pi / 4, phi)[None]
        wanted = (brdf.f_r(wi, above) + brdf.f_r(above, wi)) / 2
        np.testing.assert_allclose(measurement.f_r[3, node, 0, 0], wanted[0], rtol=1e-6)


def test_anisotropic_colours_out_of_gamut(tmp_path):
    made = rgl_files.fields_of(rgl_files.glossy, QUARTER, n=4, n_theta=3)
    made["rgb"][:, :, 2, :2] = -1
    made["rgb"][:, 0, 1, 0, 0] = np.nan
    measurement = rgl.read(written(tmp_path, made))
    assert (measurement.f_r >= 0).all()
    assert 0 < measurement.report.negative < measurement.report.usable
    assert 0 < measurement.report.non_finite == (~measurement.valid).sum()


@pytest.mark.parametrize("key", ["theta_i", "phi_i", "ndf", "sigma", "vndf", "rgb", "jacobian"])
def test_missing_field(tmp_path, fields, key):
    path = written(tmp_path, {k: v for k, v in fields.items() if k != key})
    with pytest.raises(MeasurementError, match=f'^a\\.bsdf: has no field "{key}"'):
        rgl.load(path)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("theta_i", np.zeros((3, 1), "<f4"), "3 x 1 of float32, expected 3 of float32"),
        ("theta_i", np.array([0, 2, 1], "<f4"), '"theta_i" does not increase'),
        ("theta_i", np.array([0, np.nan, 1], "<f4"), '"theta_i" does not increase'),
        ("theta_i", np.array([0, 1, np.inf], "<f4"), '"theta_i" does not increase'),
        ("theta_i", np.array([0, 1], "<f4"), '"vndf" is .* expected 1 x 2 x any x any'),
        ("theta_i", np.array([0, 1, 2], "<i4"), "int32, expected 3 of float32"),
        ("phi_i", np.array([0, 0.1, 0.2], "<f4"), "expected 3 x 3 x any x any"),
        ("ndf", np.ones((1, 24), "<f4"), "1 x 24 of float32, expected any x any"),
        ("ndf", np.full((2, 2), -1, "<f4"), '"ndf" holds negative'),
        ("sigma", np.full((2, 2), np.nan, "<f4"), '"sigma" holds negative'),
        ("vndf", np.full((1, 3, 2, 2), np.inf, "<f4"), '"vndf" holds negative'),
        ("rgb", np.ones((1, 3, 4, 8, 8), "<f4"), "expected 1 x 3 x 3 x any x any"),
        ("rgb", np.ones((3, 8, 8), "<f4"), "3 x 8 x 8 of float32"),
        ("jacobian", np.ones(1, "<f4"), "expected 1 of uint8"),
        ("jacobian", np.ones(2, "u1"), "2 of uint8, expected 1 of uint8"),
        ("wavelengths", np.ones(16, "<f4"), '"wavelengths" does not increase'),
        ("wavelengths", np.arange(16, dtype="<f4"), 'has no field "spectra"'),
    ],
)
def test_fields_that_do_not_fit(tmp_path, fields, key, value, message):
    with pytest.raises(MeasurementError, match=rf"^a\.bsdf: .*{message}"):
        rgl.load(written(tmp_path, {**fields, key: value}))


def test_range_of_phi_that_no_symmetry_explains(tmp_path):
    made = rgl_files.fields_of(rgl_files.glossy, np.linspace(0, 2, 4), n=4, n_theta=2)
    with pytest.raises(MeasurementError, match="spans 115 degrees, expected 360, 180 or 90"):
        rgl.load(written(tmp_path, made))


def test_damaged_bytes_raise_nothing_else(tmp_path, fields):
    """Any byte of the list of fields and some of the data, replaced by any other."""
    content = rgl_files.tensor_bytes(fields)
    rng = np.random.default_rng(5)
    path = tmp_path / "a.bsdf"
    places = [*range(450), *rng.integers(450, len(content), 150)]
    refused = 0
    for place in places:
        damaged = bytearray(content)
        damaged[place] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            rgl.load(path).brdf.f_r(*pairs_of(10))
        except MeasurementError:
            refused += 1
    assert 200 < refused < len(places)


def test_memory_is_bounded_by_the_size(tmp_path):
    """A file of many wavelengths, which a careless conversion would square."""
    n = 20_000
    made = rgl_files.fields_of(rgl_files.glossy, n=2, n_theta=2)
    del made["rgb"]
    made["wavelengths"] = np.linspace(300, 1000, n, dtype="<f4")
    made["spectra"] = np.ones((1, 2, n, 2, 2), "<f4")
    path = written(tmp_path, made)
    tracemalloc.start()
    try:
        rgl.load(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 8 * path.stat().st_size


def test_folder_and_missing_file(tmp_path):
    with pytest.raises(MeasurementError, match=r"a folder, not a regular file; choose an RGL"):
        rgl.load(tmp_path)
    with pytest.raises(MeasurementError, match=r"^gone\.bsdf: no such file"):
        rgl.load(tmp_path / "gone.bsdf")
