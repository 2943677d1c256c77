# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps a scene from rendering measured materials, and the click that changes it."""

from types import SimpleNamespace

import pytest


@pytest.fixture
def setup(addon):
    return addon("render_setup")


@pytest.fixture
def ready(blender):
    """A scene that renders measured materials."""
    scene = blender.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True
    scene.cycles.device = "CPU"
    return scene


def state(scene):
    return scene.render.engine, scene.cycles.shading_system, scene.cycles.device


@pytest.mark.osl
def test_nothing_is_in_the_way_of_a_scene_that_is_ready(blender, setup, ready):
    assert setup.obstacles(blender.context) == []
    assert not blender.ops.nfm.set_up_render.poll()


@pytest.mark.osl
def test_one_click_changes_what_is_wrong_and_tells_it(blender, setup, ready, capfd):
    ready.render.engine = "BLENDER_WORKBENCH"
    ready.cycles.shading_system = False
    assert len(setup.obstacles(blender.context)) == 2
    assert blender.ops.nfm.set_up_render() == {"FINISHED"}
    assert state(ready) == ("CYCLES", True, "CPU")
    assert "Changed: render engine: Cycles; Open Shading Language: on" in capfd.readouterr().out


@pytest.mark.osl
@pytest.mark.parametrize(
    ("kind", "is_obstacle"), [("NONE", False), ("OPTIX", False), ("CUDA", True), ("HIP", True)]
)
def test_a_gpu_is_in_the_way_unless_it_runs_osl(kind, is_obstacle, blender, setup, ready):
    ready.cycles.device = "GPU"
    cycles = SimpleNamespace(preferences=SimpleNamespace(compute_device_type=kind))
    context = SimpleNamespace(scene=ready, preferences=SimpleNamespace(addons={"cycles": cycles}))
    assert [o.change for o in setup.obstacles(context)] == ["device: CPU"] * is_obstacle
    setup.set_up(context)
    assert ready.cycles.device == ("CPU" if is_obstacle else "GPU")


def test_a_blender_without_osl_is_told_and_nothing_is_changed(blender, setup, ready, monkeypatch):
    import _cycles

    monkeypatch.setattr(_cycles, "with_osl", False)
    ready.render.engine = "BLENDER_WORKBENCH"
    (obstacle,) = setup.obstacles(blender.context)
    assert "no Open Shading Language" in obstacle.problem
    assert setup.set_up(blender.context) == []
    assert ready.render.engine == "BLENDER_WORKBENCH"


@pytest.mark.osl
@pytest.mark.parametrize("automatic", [False, True])
def test_importing_switches_the_scene_only_if_preferred(
    automatic, addon, blender, ready, parameter_path, mesh_object, monkeypatch, capfd
):
    ready.render.engine = "BLENDER_WORKBENCH"
    monkeypatch.setattr(addon("preferences").DEFAULTS, "automatic_set_up", automatic)
    mesh_object()
    blender.ops.nfm.import_measurement(filepath=str(parameter_path))
    assert ready.render.engine == ("CYCLES" if automatic else "BLENDER_WORKBENCH")
    assert ("changed: render engine: Cycles" in capfd.readouterr().out) == automatic
