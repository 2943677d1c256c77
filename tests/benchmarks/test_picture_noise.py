import numpy as np
import pytest

from benchmarks.picture_noise import image_error, noise_of

SHAPE = (4000, 3)


def renders(rng, sigma, seeds=4, samples=64, converged_samples=256, mean=2.0):
    truth = mean * rng.uniform(0.5, 1.5, SHAPE)
    pictures = truth + sigma * rng.standard_normal((seeds, *SHAPE))
    scale = sigma * np.sqrt(samples / converged_samples)
    converged = truth + scale * rng.standard_normal(SHAPE)
    return pictures, converged, samples, converged_samples


@pytest.mark.parametrize("converged_samples", [16, 256])
def test_noise_is_that_of_one_picture_however_noisy_the_converged_one(rng, converged_samples):
    sigma = 0.3
    noise = noise_of(*renders(rng, sigma, converged_samples=converged_samples))
    assert noise.mean == pytest.approx(2, rel=0.02)
    assert noise.rmse == pytest.approx(sigma / 2, rel=0.02)
    # two-sided 99.9 % of a normal distribution
    assert noise.p999 == pytest.approx(3.29 * sigma / 2, rel=0.05)


def test_largest_pixel_is_relative_to_its_own_converged_value(rng):
    pictures, converged, *samples = renders(rng, 0.0)
    pictures[2, 7] *= 40
    noise = noise_of(pictures, converged, *samples)
    assert noise.largest == pytest.approx(40)


def test_largest_pixel_of_a_dark_one_is_relative_to_a_hundredth_of_the_mean():
    pictures, converged = np.ones((2, *SHAPE)), np.ones(SHAPE)
    pictures[:, 0] = converged[0] = 1e-6
    pictures[1, 0] = 0.5
    assert noise_of(pictures, converged, 64, 256).largest == pytest.approx(50, rel=0.01)


def test_black_pictures_have_no_noise():
    noise = noise_of(np.zeros((2, *SHAPE)), np.zeros(SHAPE), 64, 256)
    assert (noise.mean, noise.rmse, noise.largest) == (0, 0, 0)


def test_error_without_noise_has_no_gap():
    truth = np.full(SHAPE, 2.0)
    picture = truth + 0.02 * np.sign(np.arange(SHAPE[0]) % 2 - 0.5)[:, None]
    lower, upper = image_error((picture, picture), (truth, truth))
    assert lower == pytest.approx(0.01)
    assert upper == pytest.approx(0.01)


def test_one_noisy_pixel_is_no_error(rng):
    truth = np.full(SHAPE, 2.0)
    halves = [truth + 0.01 * rng.standard_normal(SHAPE) for _ in range(2)]
    halves[0][5] += 1000
    halves[1][5] += 100
    assert image_error(tuple(halves), (truth, truth))[0] == 0


@pytest.mark.parametrize(("error", "sigma"), [(0.02, 0.02), (0.02, 0.1), (0.0, 0.1)])
def test_error_lies_between_the_bounds(rng, error, sigma):
    truth = np.full(SHAPE, 2.0)

    def noisy(picture):
        return picture + sigma * rng.standard_normal(SHAPE)

    wrong = truth + 2 * error
    lower, upper = image_error((noisy(wrong), noisy(wrong)), (noisy(truth), noisy(truth)))
    assert lower <= error <= upper
    # sigma of the difference of two halves; what the noise hides is at most about that
    assert lower >= min(error, error**2 / sigma) * 0.5
    assert upper - error < sigma
