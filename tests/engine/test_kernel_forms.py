"""Forms of one kernel: wide or narrow, five inputs or four. They must not differ by more than rounding."""

import numpy as np
import pytest

from bns.engine import narrow, wide
from bns.engine.philox import Key
from bns.engine.snn import BLOCK, INPUTS, initial_weights, last_input_is_absent, predict_into

HIDDEN = 20
SIZES = (1, 3, 4, 7, 8, 16, 31, 61, 400, 512)


def patterns(n, inputs):
    """Inputs (5, n) of networks with so many, and errors (n,)."""
    draws = np.random.default_rng(n)
    X = draws.uniform(-1, 1, (INPUTS, n)).astype(np.float32)
    X[inputs:] = 0
    return X, draws.normal(size=n).astype(np.float32)


def both_ways(way, X, error, absent, inputs, number=0):
    """Activations, outputs and gradient (W,) of one network, for the last ``len(error)`` patterns: block ``number``."""
    n, size, weights = X.shape[1], error.size, initial_weights(Key(3, 1), 1, HIDDEN, inputs)[0]
    hidden_out, out, gradient = np.zeros((HIDDEN, BLOCK), np.float32), np.zeros(BLOCK, np.float32), np.zeros_like(weights)
    prepared, errors = way.prepared(X, n, -(-n // (number + 1))), np.zeros(BLOCK, np.float32)
    errors[:size] = error
    way.forward(prepared, number, weights, hidden_out, out, n - size, n, absent)
    way.backward(prepared, number, weights, hidden_out, errors, gradient, n - size, n, absent)
    return hidden_out[:, :size], out[:size], gradient


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("inputs", [4, 5])
def test_the_wide_form_gives_what_the_narrow_one_gives(n, inputs):
    X, error = patterns(n, inputs)
    all_wide, all_narrow = (both_ways(way, X, error, inputs == 4, inputs) for way in (wide, narrow))
    for found, expected in zip(all_wide, all_narrow, strict=True):
        assert np.abs(expected).max() > 0
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)


def test_the_wide_form_takes_patterns_of_a_later_block():
    X, error = patterns(75, 5)
    alone = both_ways(wide, np.ascontiguousarray(X[:, 38:]), error[38:], False, 5)
    for found, expected in zip(both_ways(wide, X, error[38:], False, 5, number=1), alone, strict=True):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("where", [0, 15, 16, 18])
def test_what_is_not_a_number_stays_visible_in_the_wide_form(where):
    X, error = patterns(19, 5)
    X[2, where] = np.nan
    hidden_out, out, gradient = both_ways(wide, X, error, False, 5)
    assert np.isnan(hidden_out[:, where]).all()
    assert np.flatnonzero(np.isnan(out)).tolist() == [where]
    assert np.isnan(gradient[:-1]).all()


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("way", [wide, narrow])
def test_an_input_that_is_absent_can_be_left_out_bit_for_bit(n, way):
    X, error = patterns(n, 4)
    for with_it, without in zip(both_ways(way, X, error, False, 4), both_ways(way, X, error, True, 4), strict=True):
        np.testing.assert_array_equal(with_it, without)


def test_an_input_is_absent_only_where_it_is_0_in_every_pattern_in_use():
    X, _ = patterns(9, 4)
    assert last_input_is_absent(X, 9)
    X[4, 8] = 1e-30
    assert not last_input_is_absent(X, 9)
    assert last_input_is_absent(X, 8)
    X[4, 8] = np.nan
    assert not last_input_is_absent(X, 9)


def test_predictions_with_an_absent_input_are_those_with_it():
    weights, (X, _) = initial_weights(Key(1, 1), 3, HIDDEN, 4), patterns(100, 4)
    hardly = np.concatenate([X, np.eye(INPUTS, 1, -4, np.float32)], axis=1)  # one pattern more, with all five
    with_it, without = np.empty((3, 101), np.float32), np.empty((3, 101), np.float32)
    predict_into(weights, hardly, 101, with_it)
    predict_into(weights, X, 100, without)
    np.testing.assert_array_equal(with_it[:, :100], without[:, :100])


def folded(sums):
    """The sum of a row of numbers, half and half."""
    while len(sums) > 1:
        sums = sums[: len(sums) // 2] + sums[len(sums) // 2 :]
    return sums[0]


@pytest.mark.parametrize("n", [1, 7, 8, 63, 64, 71, 72, 200, 511, 512])
def test_errors_are_added_up_in_an_order_that_no_compiler_chooses(n):
    error = np.random.default_rng(n).normal(size=n).astype(np.float32)
    full, rest = n // 64 * 64, n % 64 // 8 * 8
    sums = np.zeros(64, np.float32)
    for at in range(0, full, 64):
        sums += error[at : at + 64]
    pairs = (sums[:16] + sums[16:32]) + (sums[32:48] + sums[48:])
    eight = np.zeros(8, np.float32)
    eight[0] = folded(pairs)
    for at in range(full, full + rest, 8):
        eight += error[at : at + 8]
    total = folded(eight)
    for one in error[full + rest :]:
        total += one
    assert wide.total(error, np.float32(0)) == total
