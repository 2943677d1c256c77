"""The measured main direction is offered as a Rotation."""

from dataclasses import replace

import numpy as np
import pytest

from fitter.formats.parameter_file import FittedMaterial
from fitter.models.anisotropy import anisotropy
from tests.models import ANISOTROPIC_MODELS, MODELS

BRUSHED = ANISOTROPIC_MODELS["brushed"]


def turned(steps):
    """The model turned counter-clockwise by steps of 7.5 degrees."""
    return replace(
        BRUSHED,
        ndf=np.roll(BRUSHED.ndf, steps, axis=2),
        masking=np.roll(BRUSHED.masking, steps, axis=2),
    )


@pytest.fixture
def on_object(addon, mesh_object):
    """A material of a model on the active object."""

    def put(model):
        material = addon("material").build(FittedMaterial("test", model), "REFERENCE")
        thing = mesh_object()
        thing.data.materials.append(material)
        return material

    return put


@pytest.mark.parametrize("steps", [0, 3, -5, 20])
def test_rotation_takes_the_direction_back(steps, blender, addon, on_object):
    model = turned(steps)
    material = on_object(model)
    found = anisotropy(model)
    assert material.nfm.anisotropy_direction == pytest.approx(found.direction)
    assert material.nfm.anisotropy_strength == pytest.approx(found.strength)
    assert blender.ops.nfm.align_brushing() == {"FINISHED"}
    rotation = addon("node_group").find_group_node(material).inputs["Rotation"].default_value
    # in whole steps the tables can be turned as the socket turns the material
    assert rotation / 7.5 == pytest.approx(round(rotation / 7.5), abs=0.02)
    along = anisotropy(turned(steps + round(rotation / 7.5))).direction
    assert along == pytest.approx(0, abs=0.2)


def test_undo(blender, addon, on_object):
    material = on_object(turned(3))
    blender.ops.ed.undo_push(message="before")
    blender.ops.nfm.align_brushing()
    blender.ops.ed.undo_push(message="after")
    blender.ops.ed.undo()
    material = blender.data.materials[0]
    inputs = addon("node_group").find_group_node(material).inputs
    assert inputs["Rotation"].default_value == 0


def test_isotropic_materials_have_no_direction(blender, on_object):
    material = on_object(MODELS["matte"])
    assert (material.nfm.anisotropy_direction, material.nfm.anisotropy_strength) == (0, 0)
    assert not blender.ops.nfm.align_brushing.poll()


def test_replaced_models_have_their_own_direction(addon, on_object):
    material = on_object(turned(0))
    addon("material").replace_model(material, FittedMaterial("other", turned(4)))
    expected = anisotropy(turned(4)).direction
    assert material.nfm.anisotropy_direction == pytest.approx(expected)
