import struct

import numpy as np
import pytest

LIGHT = (0.25, 2.0, 0.001)


@pytest.fixture
def rendering(addon):
    return addon("rendering")


@pytest.fixture
def refused(addon):
    return addon("errors").NfmError


@pytest.fixture
def scene(blender, addon, fitted, tmp_path):
    """A small square under light of one colour, which the rest of the picture shows."""
    light = tmp_path / "light.exr"
    addon("images").write_linear(light, np.broadcast_to(LIGHT, (4, 8, 3)))
    data = blender.data
    scene = data.scenes.new("Square")
    scene.world = addon("standard_sphere").new_world(light)
    scene.world.cycles.sampling_method = "NONE"  # no need to wait for the map's density
    mesh = data.meshes.new("Square")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(addon("material").build(fitted))
    camera = data.objects.new("Camera", data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 6, (0, 0, 2)
    for item in (data.objects.new("Square", mesh), camera):
        scene.collection.objects.link(item)
    scene.camera = camera
    addon("rendering").render_settings(scene, 12, 12, samples=2, seed=0)
    return scene


def exr_channels(path):
    """Pixel type of each channel, 2 is 32-bit float."""
    content = path.read_bytes()
    start = content.index(b"channels\0chlist\0") + 16
    (size,) = struct.unpack_from("<i", content, start)
    body = content[start + 4 : start + 4 + size]
    channels = {}
    while body[:1] != b"\0":
        name, _, body = body.partition(b"\0")
        channels[name.decode()] = struct.unpack_from("<i", body)[0]
        body = body[16:]
    return channels


def test_exr_is_linear_and_32_bit(scene, rendering, addon, tmp_path):
    path = tmp_path / "out.exr"
    rendering.render_to_file(scene, path)
    assert {name: kind for name, kind in exr_channels(path).items() if name in "RGB"} == {
        "R": 2,
        "G": 2,
        "B": 2,
    }
    pixels = addon("images").read_linear(path)
    assert pixels.shape == (12, 12, 3)
    np.testing.assert_allclose(pixels[0, 0], LIGHT, rtol=1e-6)
    assert (pixels[6, 6] != pixels[0, 0]).all()


def test_png_is_8_bit_srgb(blender, scene, rendering, tmp_path):
    path = tmp_path / "out.PNG"
    rendering.render_to_file(scene, path)
    header = path.read_bytes()[:29]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    width, height, depth, kind = struct.unpack_from(">IIBB", header, 16)
    assert (width, height, depth, kind) == (12, 12, 8, 2)
    image = blender.data.images.load(str(path))
    border = np.reshape(image.pixels[:], (12, 12, -1))[:4, :, :3] * 255
    encoded = [1.055 * x ** (1 / 2.4) - 0.055 if x > 0.0031308 else 12.92 * x for x in LIGHT]
    # Blender dithers by up to a step
    np.testing.assert_allclose(border.mean((0, 1)), np.minimum(encoded, 1) * 255.0, atol=0.7)


def test_one_file_and_nothing_else(scene, rendering, tmp_path):
    folder = tmp_path / "new"
    folder.mkdir()
    rendering.render_to_file(scene, folder / "a picture.exr")
    assert [path.name for path in folder.iterdir()] == ["a picture.exr"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("out.tif", r"^out\.tif: cannot write \.tif; use \.exr or \.png$"),
        ("out", r"^out: cannot write a file without suffix"),
        ("out.exr.bak", r"^out\.exr\.bak: cannot write \.bak"),
        ("none/out.exr", r"^out\.exr: its folder does not exist"),
        ("folder.png", r"^folder\.png: is a folder"),
        ("new\nline.jpg", r"^new\\nline\.jpg: cannot write \.jpg"),
    ],
)
def test_unusable_name_is_refused_before_rendering(
    name, message, scene, rendering, refused, tmp_path
):
    (tmp_path / "folder.png").mkdir()
    before = sorted(tmp_path.rglob("*"))
    path = scene.render.filepath
    with pytest.raises(refused, match=message):
        rendering.render_to_file(scene, tmp_path / name)
    assert sorted(tmp_path.rglob("*")) == before
    assert scene.render.filepath == path


def test_failure_keeps_the_existing_file(scene, rendering, tmp_path, capfd):
    path = tmp_path / "out.exr"
    path.write_bytes(b"precious")
    scene.camera = None
    before = sorted(tmp_path.iterdir())
    with pytest.raises(RuntimeError, match="camera"):
        rendering.render_to_file(scene, path, on_progress=lambda _share: None)
    assert path.read_bytes() == b"precious"
    assert sorted(tmp_path.iterdir()) == before
    # standard output is back
    capfd.readouterr()
    print("still here")  # noqa: T201
    assert capfd.readouterr().out == "still here\n"


def test_picture_that_was_not_written_is_an_error(
    blender, scene, rendering, refused, tmp_path, monkeypatch
):
    path = tmp_path / "out.exr"
    path.write_bytes(b"precious")
    monkeypatch.setattr(rendering.Path, "is_file", lambda _path: False)
    with pytest.raises(refused, match="Blender wrote no file"):
        rendering.render_to_file(scene, path)
    monkeypatch.undo()
    assert path.read_bytes() == b"precious"
    assert not list(tmp_path.glob(".nfm-*"))


def test_success_replaces_the_existing_file(scene, rendering, addon, tmp_path):
    path = tmp_path / "out.exr"
    path.write_bytes(b"old")
    rendering.render_to_file(scene, path)
    assert addon("images").read_linear(path).shape == (12, 12, 3)


def test_other_scenes_are_untouched(blender, scene, rendering, all_names, tmp_path):
    own = blender.context.scene
    assert own != scene

    def state():
        render, image = own.render, own.render.image_settings
        return (
            blender.context.scene.name,
            *(render.engine, render.filepath, render.resolution_x, render.resolution_percentage),
            *(image.file_format, image.color_mode, image.color_depth),
            *(render.use_file_extension, own.cycles.samples, own.view_settings.view_transform),
            own.camera,
        )

    before, names = state(), all_names()
    rendering.render_to_file(scene, tmp_path / "out.exr")
    assert state() == before
    after = all_names()
    after["images"] = [name for name in after["images"] if name != "Render Result"]
    names["images"] = [name for name in names["images"] if name != "Render Result"]
    assert after == names


@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_standard_output_stays_empty(suffix, scene, rendering, tmp_path, capfd):
    capfd.readouterr()
    rendering.render_to_file(scene, tmp_path / f"out{suffix}")
    assert capfd.readouterr().out == ""


def test_progress_is_a_rising_share(blender, addon, fitted, rendering, sphere_scene, tmp_path):
    scene = sphere_scene(addon("material").build(fitted), resolution=32, samples=64)
    handlers = list(blender.app.handlers.render_stats)
    shares = []
    rendering.render_to_file(scene, tmp_path / "out.exr", shares.append)
    assert shares
    assert shares == sorted(shares)
    assert 0 <= shares[0] <= shares[-1] <= 1
    assert list(blender.app.handlers.render_stats) == handlers


def test_settings_are_the_plain_estimator(scene):
    cycles = scene.cycles
    assert scene.render.engine == "CYCLES"
    assert (cycles.device, cycles.shading_system) == ("CPU", True)
    assert not cycles.use_denoising
    assert not cycles.use_adaptive_sampling
    assert (cycles.sample_clamp_direct, cycles.sample_clamp_indirect, cycles.blur_glossy) == (
        0,
    ) * 3


def test_remove_scene_leaves_only_materials(blender, addon, tmp_path, fitted):
    kinds = ("scenes", "objects", "meshes", "cameras", "worlds", "images", "materials")

    def names():
        return {kind: getattr(blender.data, kind).keys() for kind in kinds}

    material = addon("material").build(fitted)
    environment = tmp_path / "map.exr"
    addon("images").write_linear(environment, np.ones((4, 8, 3)))
    before = names()
    sphere = addon("standard_sphere")
    scene = sphere.build_scene(material, sphere.SphereView(environment=environment))
    assert names() != before
    addon("rendering").remove_scene(scene)
    assert names() == before
