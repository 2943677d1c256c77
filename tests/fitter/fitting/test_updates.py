# SPDX-License-Identifier: GPL-3.0-or-later
from dataclasses import replace

import numpy as np
import pytest

from fitter.fitting import updates
from fitter.fitting.problem import Problem, amplitudes
from fitter.fitting.updates import (
    update_diffuse_and_scale,
    update_fresnel,
    update_masking,
    update_ndf,
)

# A sum over this problem's samples is good to about this.
ROUNDING = 1e-12

CLOSED_FORMS = {
    update_diffuse_and_scale: ("diffuse", "scale"),
    update_ndf: ("ndf",),
    update_fresnel: ("fresnel",),
}


def moments_of(problem, model):
    return problem.moments(problem.kernels(model.masking))


def with_number(model, name, index, value):
    array = getattr(model, name).copy()
    array[index] = value
    return replace(model, **{name: array})


def lifted(scale, start):
    """Mask of the scales that the floor keeps from their true minimum, zero."""
    floor = updates.SCALE_FLOOR * np.array([scale.max(), start.scale.max()])
    return np.isclose(scale[..., None], floor, rtol=1e-9).any(-1)


@pytest.mark.parametrize("update", CLOSED_FORMS, ids=lambda u: u.__name__)
def test_closed_form_is_a_minimum(coarse, random_model, update):
    rng = np.random.default_rng(0)
    checked = numbers = 0
    for seed in range(6):
        start = random_model(seed)
        moments = moments_of(coarse, start)
        model = update(coarse, moments, start)
        least = coarse.objective(model, moments)
        assert least < coarse.objective(start, moments)
        if update is update_diffuse_and_scale and lifted(model.scale, start).all():
            continue  # far from the minimum, on purpose
        checked += 1
        for name in CLOSED_FORMS[update]:
            array = getattr(model, name)
            chosen = rng.permutation(list(np.ndindex(array.shape)))[:12]
            for index in map(tuple, chosen):
                if name == "scale" and lifted(array, start)[index]:
                    continue
                if array[index] == getattr(start, name)[index]:
                    continue  # held, for lack of data
                numbers += 1
                value, typical = array[index], array.mean()
                for step in (1e-2, -1e-2, 1e-4, -1e-4):
                    trial = with_number(model, name, index, max(value + step * typical, 0))
                    assert coarse.objective(trial, moments) >= least * (1 - ROUNDING), (name, index)
    assert checked >= 2
    assert numbers >= 3 * checked


def test_numbers_without_data_are_held(coarse, random_model):
    """Where G is zero, D cannot be seen: it keeps its value instead of taking any."""
    start = random_model(2)
    masking = start.masking.copy()
    masking[:, 60:] = 0
    start = replace(start, masking=masking)
    moments = moments_of(coarse, start)
    np.testing.assert_array_equal(
        updates.update_ndf(coarse, moments, start).ndf[:, -2:], start.ndf[:, -2:]
    )
    np.testing.assert_array_equal(
        updates.update_fresnel(coarse, moments, start).fresnel[:, -2:], start.fresnel[:, -2:]
    )


@pytest.mark.parametrize("update", CLOSED_FORMS, ids=lambda u: u.__name__)
def test_closed_form_is_a_joint_minimum(coarse, random_model, update):
    """Solved together, the numbers of one system are optimal along every direction."""
    rng = np.random.default_rng(1)
    start = random_model(4)
    moments = moments_of(coarse, start)
    model = update(coarse, moments, start)
    if update is update_ndf:
        # one theta_h bin after another could not do better than all lobes at once
        again = update(coarse, moments, model)
        np.testing.assert_allclose(again.ndf, model.ndf, rtol=1e-6, atol=1e-9)
    least = coarse.objective(model, moments)
    for _ in range(20):
        changed = {}
        for name in CLOSED_FORMS[update]:
            array = getattr(model, name)
            noise = 1e-3 * rng.standard_normal(array.shape)
            changed[name] = np.maximum(array + noise * array.mean(), 0)
            if name == "scale":
                changed[name] = np.where(lifted(array, start), array, changed[name])
        trial = coarse.objective(replace(model, **changed), moments)
        assert trial >= least * (1 - ROUNDING)


@pytest.mark.parametrize("seed", range(20))
def test_no_update_raises_the_objective(coarse, random_model, seed):
    rng = np.random.default_rng(seed)
    model = random_model(seed)
    if seed % 2:  # numbers that are zero are where updates go wrong
        ndf = np.where(rng.random((3, 90)) < 0.3, 0, model.ndf)
        model = replace(model, ndf=ndf, diffuse=np.zeros(3))
    kernels = coarse.kernels(model.masking)
    start = objective = coarse.objective_of(model)
    for _ in range(2):
        moments = coarse.moments(kernels)
        for update in CLOSED_FORMS:
            model = update(coarse, moments, model)
            value = coarse.objective(model, moments)
            assert value <= objective * (1 + ROUNDING), update.__name__
            objective = value
        for lobe in range(3):
            model = update_masking(coarse, kernels, model, lobe)
            kernels[lobe] = coarse.kernels(model.masking[lobe : lobe + 1])[0]
            value = coarse.objective_of(model)
            assert value <= objective * (1 + ROUNDING), lobe
            objective = value
        for name in ("diffuse", "scale", "ndf", "masking", "fresnel"):
            assert np.isfinite(getattr(model, name)).all()
            assert (getattr(model, name) >= 0).all()
    assert objective < start / 2
    assert (model.scale > 0).all()


def test_updates_leave_their_input(coarse, random_model):
    model = random_model(0)
    before = {name: array.copy() for name, array in vars(model).items()}
    kernels = coarse.kernels(model.masking)
    update_masking(coarse, kernels, model, 1)
    for update in CLOSED_FORMS:
        update(coarse, moments_of(coarse, model), model)
    for name, array in before.items():
        np.testing.assert_array_equal(getattr(model, name), array)
    np.testing.assert_array_equal(kernels, coarse.kernels(model.masking))


def test_scale_is_never_zero(coarse, random_model):
    # a lobe that the data does not want at all: the first, where there is no highlight
    start = random_model(1)
    ndf = start.ndf.copy()
    ndf[0] = np.linspace(0, 1, 90) ** 20
    start = replace(start, ndf=ndf, masking=np.ones((3, 90)))
    moments = moments_of(coarse, start)
    model = update_diffuse_and_scale(coarse, moments, start)
    assert (model.scale > 0).all()
    floor = updates.SCALE_FLOOR * model.scale.max()
    assert model.scale.min() == pytest.approx(floor, rel=1e-9)


def test_lobes_that_the_data_does_not_want_come_back(coarse, random_model):
    """All scales at once would be zero here; D would follow, and the fit would stay Lambertian."""
    start = random_model(0)
    moments = moments_of(coarse, start)
    model = update_diffuse_and_scale(coarse, moments, start)
    assert (model.scale > 0).all()
    lambert = coarse.objective(model, moments)
    model = update_ndf(coarse, moments, model)
    assert coarse.objective(model, moments) < 0.9 * lambert


def test_empty_bins_keep_their_numbers(two_lobes, random_model, make_measurement):
    valid = two_lobes.valid.copy()
    valid[10:13] = False
    valid[:, 40:42] = False
    problem = Problem(make_measurement(two_lobes.f_r, valid), phi_group=45, n_angles=60)
    start = random_model(2)
    moments = moments_of(problem, start)
    ndf = update_ndf(problem, moments, start).ndf
    np.testing.assert_array_equal(ndf[:, 10:13], start.ndf[:, 10:13])
    assert (ndf[:, 13] != start.ndf[:, 13]).all()
    fresnel = update_fresnel(problem, moments, start).fresnel
    np.testing.assert_array_equal(fresnel[:, 40:42], start.fresnel[:, 40:42])
    assert (fresnel[:, 42] != start.fresnel[:, 42]).all()


# --- G ---


def golden_section(function, low, high, steps=40):
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(steps):
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        if function(left) < function(right):
            high = right
        else:
            low = left
    return (low + high) / 2


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("k", [0, 1, 2, 30, 60, 86, 87, 88, 89])
def test_masking_update_is_the_minimum_over_each_control_point(tiny, random_model, seed, k):
    start = random_model(seed)
    lobe = seed
    updated = update_masking(tiny, tiny.kernels(start.masking), start, lobe).masking
    np.testing.assert_array_equal(np.delete(updated, lobe, 0), np.delete(start.masking, lobe, 0))

    # when the k-th was solved, those before it were new and those behind it old
    masking = start.masking.copy()
    masking[lobe, :k] = updated[lobe, :k]

    # E as a plain sum over samples, up to a constant
    a = amplitudes(start).reshape(-1, 3, 3)
    others = [m for m in range(3) if m != lobe]
    kernels = tiny.kernels(start.masking)[others]
    rest = start.diffuse + np.einsum("xmc,mxp->xpc", a[:, others], kernels)

    def objective(x):
        masking[lobe, k] = x
        kernel = tiny.kernels(masking[lobe : lobe + 1])[0]
        f = rest + a[:, None, lobe] * kernel[:, :, None]
        error = (tiny.weight * f - 2 * tiny.weighted_target) * f
        return 1 + error.sum() / tiny.target_energy

    scan = np.concatenate([[0], np.geomspace(1e-4, 20, 50)])
    values = [objective(x) for x in scan]
    lowest = int(np.argmin(values))
    low, high = scan[max(lowest - 1, 0)], scan[min(lowest + 1, len(scan) - 1)]
    best = golden_section(objective, low, high)
    got = updated[lobe, k]
    assert objective(got) <= min(objective(best), values[lowest]) * (1 + ROUNDING)
    assert got == pytest.approx(best, rel=1e-2, abs=1e-6)


def test_masking_update_moves_every_control_point(tiny, random_model):
    start = random_model(5)
    updated = update_masking(tiny, tiny.kernels(start.masking), start, 2).masking
    assert np.mean(updated[2] != start.masking[2]) > 0.9


def real_roots(coefficients):
    roots = np.roots(coefficients)
    return np.sort(roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real)


def test_random_cubics():
    rng = np.random.default_rng(0)
    counts = []
    for _ in range(2000):
        coefficients = rng.standard_normal(4)
        expected = real_roots(coefficients)
        got = np.sort(updates._real_cubic_roots(*coefficients))
        assert len(got) == len(expected)
        np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-8)
        counts.append(len(got))
    assert 100 < counts.count(3) < 1900


@pytest.mark.parametrize(
    "roots",
    [
        (0, 0, 0),
        (2, 2, 2),
        (1, 1, 3),
        (-1, 0, 1),
        (1e-6, 1, 1e3),
        (-5, -5, 2),
        (0, 0, 7),
        (0, 3, 3),
    ],
)
@pytest.mark.parametrize("factor", [1, 3e-20, 7e20])
def test_cubics_with_given_roots(roots, factor):
    got = updates._real_cubic_roots(*(factor * np.poly(roots)))
    assert all(np.isfinite(got))
    for root in got:
        assert np.abs(root - np.array(roots)).min() < 1e-4 * max(map(abs, roots)) + 1e-12
    # a double root may be lost to rounding; it is no minimum of the quartic
    simple = [root for root in roots if roots.count(root) == 1]
    for root in simple:
        assert np.abs(np.array(got) - root).min() < 1e-9 * max(map(abs, roots))


@pytest.mark.parametrize("seed", range(3))
def test_minimum_of_random_quartics(seed):
    rng = np.random.default_rng(seed)
    dense = np.concatenate([[0], np.geomspace(1e-6, 1e4, 40_000)])
    for _ in range(100):
        scale = 10 ** rng.uniform(-1, 1)
        c = rng.standard_normal(4) * scale ** np.arange(4)
        c[3] = abs(c[3])

        def value(x, c=c):
            return x * (c[0] + x * (c[1] + x * (c[2] + x * c[3])))

        got = updates._minimum_of_quartic(tuple(c), 1.0)
        assert got >= 0
        assert value(got) <= value(dense).min() + 1e-12
        assert value(got) <= value(1.0)


def test_minimum_of_a_quartic_that_is_all_but_a_parabola():
    # few samples have both angles near one control point, so this is the common case
    for c4 in (1e-4, 1e-8, 1e-12, 1e-16):
        got = updates._minimum_of_quartic((-2.0, 1.0, c4, c4), 0.3)
        assert got == pytest.approx(1, rel=4 * c4 + 1e-6)


def test_control_point_that_no_data_sees_stays():
    assert updates._minimum_of_quartic((0.0, 0.0, 0.0, 0.0), 0.7) == 0.7
    assert updates._minimum_of_quartic((np.nan, 1.0, 1.0, np.nan), 0.7) == 0.7
