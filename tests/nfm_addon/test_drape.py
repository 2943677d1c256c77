"""The simulated cloth."""

import itertools

import numpy as np
import pytest

LEVELS, STEPS = (9, 17), (60, 40)


@pytest.fixture
def drape(addon, monkeypatch):
    """The module, with a coarse cloth that is there at once."""
    module = addon("drape")
    monkeypatch.setattr(module, "LEVELS", LEVELS)
    monkeypatch.setattr(module, "STEPS", STEPS)
    monkeypatch.setattr(module, "PARTICLES", LEVELS[-1])
    return module


@pytest.fixture
def cloth(drape):
    return drape.draped_cloth()


def test_the_finest_level_is_what_is_promised(addon):
    module = addon("drape")
    assert module.LEVELS[-1] == module.PARTICLES
    assert all(fine == 2 * coarse - 1 for coarse, fine in itertools.pairwise(module.LEVELS))


def test_it_is_the_same_on_every_run(drape, cloth):
    again = drape.draped_cloth()
    for one, other in zip(cloth, again, strict=True):
        np.testing.assert_array_equal(one, other)


def test_it_lies_on_the_ball_and_hangs_down(drape, cloth):
    position, _ = cloth
    distance = np.linalg.norm(position, axis=-1)
    assert distance.min() > 0.97 * drape.BALL_RADIUS
    middle = position[LEVELS[-1] // 2, LEVELS[-1] // 2]
    np.testing.assert_allclose(middle, [0, 0, drape.BALL_RADIUS], atol=0.05)
    corners = position[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert (corners[:, 2] < -0.3).all()
    assert (np.abs(corners[:, :2]) < drape.SIDE / 2).all()


def test_threads_keep_their_length(drape, cloth):
    position, _ = cloth
    step = drape.SIDE / (LEVELS[-1] - 1)
    for axis in (0, 1):
        length = np.linalg.norm(np.diff(position, axis=axis), axis=-1) / step
        assert length.min() > 0.8
        assert length.max() < 1.3
        assert length.mean() == pytest.approx(1, abs=0.05)


def test_uv_runs_along_the_threads(cloth):
    _, uv = cloth
    np.testing.assert_allclose(uv[:, 3, 0], np.linspace(0, 1, LEVELS[-1]))
    np.testing.assert_allclose(uv[5, :, 1], np.linspace(0, 1, LEVELS[-1]))
    assert (np.ptp(uv[..., 0], axis=1) == 0).all()


def test_groups_share_no_particle(drape):
    groups = drape._distances(7)
    for group in groups:
        both = np.concatenate([group.first, group.second])
        assert len(np.unique(both)) == len(both)
    pairs = {tuple(sorted(p)) for g in groups for p in zip(g.first, g.second, strict=True)}
    # neighbours along both axes, along both diagonals, and the next but one
    assert len(pairs) == 2 * 7 * 6 + 2 * 6 * 6 + 2 * 7 * 5
    first, second = (np.concatenate([getattr(g, n) for g in groups]) for n in ("first", "second"))
    rest = np.concatenate([np.full(len(g.first), g.rest) for g in groups])
    flat = np.stack(np.divmod(np.arange(49), 7), -1) * drape.SIDE / 6
    np.testing.assert_allclose(np.linalg.norm(flat[first] - flat[second], axis=1), rest)
