"""Sums of differences over a lag, against numpy's least squares and correlation."""

import numpy as np
import pytest

from bns.physics.wheels.lagged_fit import lagged_rest, lagged_sums, led_to


@pytest.fixture
def trials():
    rng = np.random.default_rng(4)
    columns, off = rng.normal(size=(3, 40, 2)), rng.normal(size=(3, 40))
    used = rng.random((3, 40)) > 0.2
    used[2] = False
    return columns, off, used


def differences(columns, off, used, row, lag):
    both = used[row, lag:] & used[row, :-lag]
    return (columns[row, lag:] - columns[row, :-lag])[both], (off[row, lag:] - off[row, :-lag])[both], both


@pytest.mark.parametrize("lag", [1, 5])
def test_sums_are_those_of_least_squares(trials, lag):
    gram, target, count = lagged_sums(*trials, lag)
    for row in range(3):
        design, change, both = differences(*trials, row, lag)
        np.testing.assert_allclose(gram[row], design.T @ design, atol=1e-12)
        np.testing.assert_allclose(target[row], design.T @ change, atol=1e-12)
        assert count[row] == both.sum()


@pytest.mark.parametrize("lag", [1, 5])
def test_the_rest_is_what_the_coefficients_leave_and_its_products_with_itself(trials, lag):
    values = np.array([[0.3, -0.2], [1.0, 0.5], [0.0, 0.0]])
    left, product, pairs = lagged_rest(*trials, lag, values, 7)
    expected, number = np.zeros(8), np.zeros(8)
    for row in range(3):
        design, change, both = differences(*trials, row, lag)
        rest = np.zeros(len(both))
        rest[both] = change - design @ values[row]
        assert left[row] == pytest.approx((rest**2).sum())
        expected += np.correlate(np.pad(rest, (0, 7)), rest, "valid")
        number += np.correlate(np.pad(both.astype(float), (0, 7)), both.astype(float), "valid")
    np.testing.assert_allclose(product, expected, atol=1e-12)
    np.testing.assert_allclose(pairs, number)


def test_a_lag_longer_than_a_trial_leaves_nothing(trials):
    columns, off, used = (values[:, :4] for values in trials)
    left, product, pairs = lagged_rest(columns, off, used, 6, np.ones((3, 2)), 2)
    assert not left.any()
    assert not product.any()
    assert not pairs.any()


def test_a_rate_leads_to_its_running_sum_half_of_the_step_included():
    rng = np.random.default_rng(5)
    rates, others, step_s = rng.normal(size=(2, 3, 10)), rng.normal(size=(1, 3, 10)), rng.random((3, 10))
    out = led_to(rates, others, step_s)
    way = rates * step_s
    np.testing.assert_allclose(out[..., :2], np.moveaxis(np.cumsum(way, axis=2) - way / 2, 0, 2), atol=1e-13)
    np.testing.assert_array_equal(out[..., 2], others[0])
