"""Lamps without size, and bpy.ops.nfm.give_lamps_size."""

import pytest

SIZES = {"POINT": "shadow_soft_size", "SPOT": "shadow_soft_size", "SUN": "angle", "AREA": "size"}


@pytest.fixture
def lamps(addon):
    return addon("lamps")


@pytest.fixture
def give_size(blender, addon):
    def run(**options):
        return blender.ops.nfm.give_lamps_size("EXEC_DEFAULT", True, **options)

    return run


@pytest.fixture
def new_lamp(blender, lamps):
    """An object with a lamp of a size, in the scene."""

    def make(name, kind="POINT", size=0.0):
        data = blender.data.lights.new(name, kind)
        setattr(data, SIZES[kind], size)
        item = blender.data.objects.new(name, data)
        blender.context.scene.collection.objects.link(item)
        return item

    return make


def size_of(lamp):
    return getattr(lamp, SIZES[lamp.type])


def names(items):
    return [item.name for item in items]


@pytest.fixture
def linked_lamp(blender, new_lamp, tmp_path):
    """An object with a lamp without size from another file, alone in the scene."""
    item = new_lamp("From a library")
    path = tmp_path / "library.blend"
    blender.data.libraries.write(str(path), {item})
    blender.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with blender.data.libraries.load(str(path), link=True) as (_, target):
        target.objects = ["From a library"]
    blender.context.scene.collection.objects.link(target.objects[0])
    return target.objects[0]


# ---- which ----


def test_without_lamps(blender, lamps):
    assert lamps.lamps_without_size(blender.context.scene) == []


@pytest.mark.parametrize("kind", SIZES)
def test_lamps_with_a_size(kind, blender, lamps, new_lamp):
    new_lamp("Lamp", kind, 0.25)
    assert lamps.lamps_without_size(blender.context.scene) == []


@pytest.mark.parametrize("kind", SIZES)
def test_lamps_without_size(kind, blender, lamps, new_lamp):
    lamp = new_lamp("Lamp", kind)
    assert lamps.lamps_without_size(blender.context.scene) == [lamp]
    lamps.give_size(lamp.data, 0.125)
    assert size_of(lamp.data) == (0.25 if kind == "AREA" else 0.125)
    assert lamps.lamps_without_size(blender.context.scene) == []


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
@pytest.mark.parametrize(
    ("sides", "expected"), [((0, 0), (0.5, 0.5)), ((0, 2), (0.5, 2)), ((2, 0), (2, 0.5))]
)
def test_lines_have_no_size(shape, sides, expected, blender, lamps, new_lamp):
    area = new_lamp("Area", "AREA").data
    area.shape = shape
    area.size, area.size_y = sides
    assert names(lamps.lamps_without_size(blender.context.scene)) == ["Area"]
    lamps.give_size(area, 0.25)
    assert (area.size, area.size_y) == expected
    assert lamps.lamps_without_size(blender.context.scene) == []


@pytest.mark.parametrize("shape", ["SQUARE", "DISK"])
def test_squares_and_discs_have_one_side(shape, blender, lamps, new_lamp):
    area = new_lamp("Area", "AREA", 0.5).data
    area.shape = shape
    area.size_y = 0
    assert lamps.lamps_without_size(blender.context.scene) == []
    area.size, area.size_y = 0, 1
    assert names(lamps.lamps_without_size(blender.context.scene)) == ["Area"]


def test_only_lamps_of_this_scene_by_name(blender, lamps, new_lamp):
    for name in ("b", "c", "a"):
        new_lamp(name)
    new_lamp("large", size=1.0)
    camera = blender.data.objects.new("Camera", blender.data.cameras.new("Camera"))
    blender.context.scene.collection.objects.link(camera)
    other = blender.data.scenes.new("Other")
    lamp = blender.data.objects.new("elsewhere", blender.data.lights.new("elsewhere", "POINT"))
    lamp.data.shadow_soft_size = 0
    other.collection.objects.link(lamp)
    assert names(lamps.lamps_without_size(blender.context.scene)) == ["a", "b", "c"]
    assert names(lamps.lamps_without_size(other)) == ["elsewhere"]


def test_blind_samplings_are_samplings(addon, lamps):
    identifiers = [item[0] for item in addon("properties").SAMPLING_ITEMS]
    assert set(lamps.BLIND_SAMPLINGS) < set(identifiers)
    assert "NATIVE" not in lamps.BLIND_SAMPLINGS


# ---- the operator ----


def test_gives_every_lamp_a_size(new_lamp, give_size, lamps, blender, capfd):
    small = [new_lamp(kind.lower(), kind) for kind in ("SUN", "POINT", "AREA", "SPOT")]
    large = new_lamp("large", size=0.5)
    assert give_size() == {"FINISHED"}
    assert [size_of(item.data) for item in small] == pytest.approx([0.01, 0.01, 0.02, 0.01])
    assert large.data.shadow_soft_size == 0.5
    assert "Info: Lamps with a size now: area, point, spot, sun\n" in capfd.readouterr().out
    assert lamps.lamps_without_size(blender.context.scene) == []


def test_of_a_given_size(new_lamp, give_size):
    lamp = new_lamp("Lamp")
    give_size(radius=0.25)
    assert lamp.data.shadow_soft_size == 0.25


def test_never_of_none(new_lamp, give_size):
    """Smaller than its smallest, Blender makes it the smallest."""
    lamp = new_lamp("Lamp")
    give_size(radius=0.0)
    assert lamp.data.shadow_soft_size == pytest.approx(1e-4)


def test_two_objects_with_one_lamp(blender, new_lamp, give_size):
    first = new_lamp("First")
    second = blender.data.objects.new("Second", first.data)
    blender.context.scene.collection.objects.link(second)
    assert give_size() == {"FINISHED"}
    assert second.data.shadow_soft_size == pytest.approx(0.01)


def test_nothing_to_do_says_so(blender, new_lamp, give_size):
    new_lamp("Lamp", size=0.1)
    assert not blender.ops.nfm.give_lamps_size.poll()
    with pytest.raises(RuntimeError, match="No lamp of this scene has a radius of zero, or all"):
        give_size()


def test_linked_lamps_are_left_alone(blender, linked_lamp, new_lamp, give_size, capfd):
    with pytest.raises(RuntimeError, match="or all are linked"):
        give_size()
    own = new_lamp("Own")
    assert give_size() == {"FINISHED"}
    assert own.data.shadow_soft_size == pytest.approx(0.01)
    assert linked_lamp.data.shadow_soft_size == 0
    assert "Lamps with a size now: Own\n" in capfd.readouterr().out


def test_is_one_undo_step(blender, new_lamp, give_size):
    new_lamp("Lamp")
    blender.ops.ed.undo_push(message="before")
    give_size()
    assert blender.data.lights["Lamp"].shadow_soft_size == pytest.approx(0.01)
    assert blender.ops.ed.undo() == {"FINISHED"}
    assert blender.data.lights["Lamp"].shadow_soft_size == 0
    assert blender.ops.ed.redo() == {"FINISHED"}
    assert blender.data.lights["Lamp"].shadow_soft_size == pytest.approx(0.01)
