import numpy as np
import pytest


@pytest.fixture
def images(addon):
    return addon("images")


@pytest.fixture
def refused(addon):
    """The error that the add-on raises for files it cannot use."""
    return addon("errors").NfmError


@pytest.fixture
def pixels():
    """All different, not square, of all magnitudes and signs."""
    rng = np.random.default_rng(0)
    values = (rng.normal(size=(5, 7, 3)) * 10 ** rng.uniform(-30, 30, (5, 7, 3))).astype(np.float32)
    values[0, 0] = 0, 1, 1e-8
    values[-1, -1] = 70000, -2, 0.1  # more than half precision holds
    return values


def test_round_trip_is_exact(images, pixels, tmp_path):
    path = tmp_path / "picture.exr"
    images.write_linear(path, pixels)
    found = images.read_linear(path)
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, pixels)


def test_double_precision_is_rounded(images, tmp_path):
    path = tmp_path / "picture.exr"
    images.write_linear(path, np.full((4, 4, 3), 0.1))
    assert (images.read_linear(path) == np.float32(0.1)).all()


def test_top_row_comes_first(blender, images, pixels, tmp_path):
    """Blender's own pixels count from the bottom."""
    path = tmp_path / "picture.exr"
    images.write_linear(path, pixels)
    image = blender.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    assert tuple(image.size) == (7, 5)
    np.testing.assert_array_equal(image.pixels[:3], pixels[-1, 0])
    np.testing.assert_array_equal(image.pixels[-image.channels :][:3], pixels[0, -1])


def test_input_is_not_modified_and_result_is_writable(images, pixels, tmp_path):
    path, before = tmp_path / "picture.exr", pixels.copy()
    images.write_linear(path, pixels)
    images.write_picture(tmp_path / "picture.png", pixels)
    np.testing.assert_array_equal(pixels, before)
    images.read_linear(path)[0, 0] = 5


def test_pictures_are_encoded_for_the_display(images, tmp_path):
    """Against the known codes of sRGB; Blender decodes to the linear values again."""
    path = tmp_path / "picture.png"
    linear = np.array([[-1, 0, 0.001], [0.2122, 0.5, 1], [2, 0.0144, 0.7305]])[:, None]
    images.write_picture(path, linear)
    expected = np.array([[0, 0, 3], [127, 188, 255], [255, 32, 222]])
    found = np.rint(images.read_linear(path)[:, 0] * 255)
    np.testing.assert_allclose(found, expected, atol=1)


def test_nothing_stays_in_the_file(images, pixels, tmp_path, all_names):
    before = all_names()
    images.write_picture(tmp_path / "picture.png", pixels)
    images.write_linear(tmp_path / "picture.exr", pixels)
    images.read_linear(tmp_path / "picture.exr")
    assert all_names() == before


@pytest.mark.parametrize("function", ["read_linear", "load_environment"])
@pytest.mark.parametrize("kind", ["missing", "folder"])
def test_missing_image(function, kind, images, refused, tmp_path, all_names, capfd):
    path = tmp_path / "none\nhere.exr"
    if kind == "folder":
        path.mkdir()
    before = all_names()
    with pytest.raises(refused, match=r"^none\\nhere\.exr: no such image; check the path$"):
        getattr(images, function)(path)
    assert all_names() == before
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("function", ["read_linear", "load_environment"])
@pytest.mark.parametrize("content", [b"", b"not an image", b"v/1\x01" + bytes(40)])
def test_corrupt_image(function, content, images, refused, tmp_path, all_names):
    path = tmp_path / "corrupt.exr"
    path.write_bytes(content)
    before = all_names()
    with pytest.raises(refused, match=r"^corrupt\.exr: cannot be read as an image; use"):
        getattr(images, function)(path)
    assert all_names() == before


@pytest.mark.parametrize("function", ["write_linear", "write_picture"])
def test_unwritable_target(function, images, refused, pixels, tmp_path, all_names):
    path = tmp_path / "folder.exr"
    path.mkdir()
    before = all_names()
    with pytest.raises(refused, match=r"^folder\.exr: cannot be written \(.*\); choose another"):
        getattr(images, function)(path, pixels)
    assert all_names() == before
