"""The first population, ranking, tournaments and diversity."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bns.engine import reference
from bns.engine.evolution import CommandBounds, Population, diversity, pick, random_population, rank, tournament_cdf
from bns.engine.philox import Key, Purpose

BOUNDS = CommandBounds(*(np.array(v, np.float32) for v in ([-1, 0, 10], [1, 5, 20], [0.5, 1, 3])))


def population(n, seed=0, capacity=30, shortest=4, longest=13):
    return random_population(Key(seed, 1), n, shortest, longest, capacity, BOUNDS)


def made(*controllers):
    """A population of these lists of commands (length, 3)."""
    commands = np.full((len(controllers), 8, 3), 1e6, np.float32)  # what lies behind a list must not matter
    for i, one in enumerate(controllers):
        commands[i, : len(one)] = one
    return Population(commands, np.array([len(one) for one in controllers], np.int32))


def test_first_lengths_are_uniform_4_to_13():
    lengths = population(20_000).lengths
    counts = np.bincount(lengths, minlength=14)[4:]
    assert (lengths.min(), lengths.max()) == (4, 13)
    assert ((counts - 2000) ** 2 / 2000).sum() < 27.9  # 9 degrees of freedom, one in a thousand


def test_first_commands_are_uniform_within_their_bounds():
    some = population(2000)
    used = np.concatenate([some.controller(i) for i in range(2000)])
    assert (used >= BOUNDS.low).all()
    assert (used <= BOUNDS.high).all()
    for c in range(3):
        counts = np.histogram(used[:, c], 10, (BOUNDS.low[c], BOUNDS.high[c]))[0]
        expected = len(used) / 10
        assert ((counts - expected) ** 2 / expected).sum() < 27.9
    assert abs(np.corrcoef(used.T) - np.eye(3)).max() < 4 / np.sqrt(len(used))


def test_a_larger_population_begins_with_the_smaller_one():
    few, many = population(5, capacity=20), population(50, capacity=100)
    np.testing.assert_array_equal(few.lengths, many.lengths[:5])
    for i in range(5):
        np.testing.assert_array_equal(few.controller(i), many.controller(i))
    assert not np.isin(population(5, seed=1).controller(0), few.controller(0)).any()


@pytest.mark.parametrize("capacity", [1, 6])
def test_lists_are_cut_at_the_capacity(capacity):
    cut, free = population(50, capacity=capacity), population(50)
    np.testing.assert_array_equal(cut.lengths, np.minimum(free.lengths, capacity))
    np.testing.assert_array_equal(cut.controller(3), free.controller(3)[:capacity])


def test_controller_is_a_copy():
    some = population(2)
    some.controller(0)[:] = 0
    assert some.controller(0).all()


@given(arrays(np.float64, st.integers(1, 30), elements=st.sampled_from([0, 0.5, 1, 2, np.nan, -np.inf])))
def test_rank_is_its_twin(fitness):
    assert rank(fitness).tolist() == reference.rank(fitness)


def test_what_is_no_number_comes_last():
    order = rank(np.array([np.nan, 0.1, -np.inf, 3.0, 0.0, np.nan, 0.2]))
    assert order.tolist() == [3, 6, 1, 0, 2, 4, 5]
    assert rank(np.full(4, np.nan)).tolist() == [0, 1, 2, 3]
    assert rank(np.ones(4)).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("n", "share"), [(40, 0.1), (40, 0.5), (40, 0.99), (7, 0.3), (400, 0.02), (3, 0.5)])
def test_tournament_table_counts_the_draws_without_replacement(n, share):
    k = max(1, round(share * n))
    exact = [1 - math.comb(n - 1 - r, k) / math.comb(n, k) for r in range(n)]
    np.testing.assert_allclose(tournament_cdf(n, share), exact, rtol=0, atol=1e-12)


@pytest.mark.parametrize("share", [0.0, 1e-9, 0.1, 0.5, 0.9, 1.0])
def test_winners_are_distributed_as_in_tournaments_played_out(share):
    n, games, random = 20, 4000, np.random.default_rng(1)
    slow = np.array([reference.tournament(random, n, share) for _ in range(games)])
    order, cdf = np.arange(n), tournament_cdf(n, share)
    fast = np.array([pick(Key(0, 0), Purpose.PICK, step, order, cdf) for step in range(games)])
    # Kolmogorov and Smirnov, two samples, one in a thousand (less for whole numbers).
    gap = np.abs([np.mean(slow <= r) - np.mean(fast <= r) for r in range(n)]).max()
    assert gap < 1.95 * np.sqrt(2 / games)
    assert np.abs([np.mean(slow <= r) - cdf[r] for r in range(n)]).max() < 1.95 / np.sqrt(games)


def test_the_extremes_of_a_tournament():
    np.testing.assert_array_equal(tournament_cdf(50, 1.0), np.ones(50))  # everybody plays, the best wins
    np.testing.assert_allclose(tournament_cdf(50, 0.0), np.arange(1, 51) / 50)  # one plays
    np.testing.assert_array_equal(tournament_cdf(1, 0.5), [1.0])
    np.testing.assert_array_equal(tournament_cdf(1, 0.0), [1.0])


@given(st.integers(1, 300), st.floats(0, 1))
def test_tournament_tables_are_distributions(n, share):
    cdf = tournament_cdf(n, share)
    assert (np.diff(cdf) >= 0).all()
    assert cdf[0] > 0
    assert cdf[-1] == 1


def test_pick_gives_back_the_member_at_the_winning_rank():
    order = np.array([4, 2, 0, 1, 3])
    assert {pick(Key(0, 0), Purpose.PICK, s, order, tournament_cdf(5, 1.0)) for s in range(50)} == {4}
    assert {pick(Key(0, 0), Purpose.PICK, s, order, tournament_cdf(5, 0.0)) for s in range(200)} == {0, 1, 2, 3, 4}


def test_diversity_by_hand():
    # Second command: normalised (0.5, 0.2, 0.1) apart; the mean lies half way; the third stands alone.
    first = [[0, 1, 12], [0, 1, 12]]
    second = [[0, 1, 12], [1, 2, 13], [0, 0, 10]]
    assert diversity(made(first, second), BOUNDS) == pytest.approx((0.5 + 0.2 + 0.1) / 2, rel=1e-6)


def test_diversity_of_one_or_of_equals_is_none():
    assert diversity(population(1), BOUNDS) == 0
    one = [[0.3, 1, 12]] * 5
    assert diversity(made(one, one, one), BOUNDS) == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_diversity_is_its_twin(seed):
    some = population(60, seed)
    assert diversity(some, BOUNDS) == pytest.approx(reference.diversity(some, BOUNDS), rel=1e-6)
    assert diversity(some, BOUNDS) > 1


def test_diversity_does_not_see_behind_the_lists():
    some = population(30)
    clean = diversity(some, BOUNDS)
    for i, length in enumerate(some.lengths):
        some.commands[i, length:] = np.nan
    assert diversity(some, BOUNDS) == clean
