"""Which explanations count as equally good, by their losses on trials held out."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose.select.indistinguishable import TIE_LOSS, TIE_SHARE, indistinguishable, matters

RNG = np.random.default_rng(0)
FIT = SimpleNamespace(held_out=RNG.normal(10, 1, 60))
WITHOUT = SimpleNamespace(held_out=FIT.held_out + 100)


def losing(losses):
    return SimpleNamespace(held_out=FIT.held_out + losses)


def test_losses_that_go_either_way_are_a_tie():
    assert indistinguishable(losing(RNG.normal(0.5, 5, 60)), FIT, WITHOUT)


def test_a_loss_that_is_nothing_beside_what_is_earned_is_a_tie_though_all_trials_show_it():
    assert indistinguishable(losing(np.full(60, 0.08)), FIT, WITHOUT)


def test_clear_losses_are_no_tie():
    assert not indistinguishable(losing(RNG.normal(10, 2, 60)), FIT, WITHOUT)


def test_a_few_wild_trials_do_not_hide_that_nearly_all_lose():
    losses = RNG.normal(10, 2, 60)
    losses[0] = 3000.0  # the mean is now hardly more than its standard error
    assert losses.mean() < 2 * losses.std(ddof=1) / np.sqrt(60)
    assert not indistinguishable(losing(losses), FIT, WITHOUT)


@pytest.mark.parametrize(("standard_errors", "tie"), [(1.9, True), (2.1, False)])
def test_a_loss_of_two_standard_errors_is_no_tie_though_half_of_the_trials_gain(standard_errors, tie):
    """Half of 60 trials lose and half gain, 50 apart from the mean either way: a standard error of 50 / √59."""
    mean = standard_errors * 50.0 / 59**0.5
    losses = mean + np.repeat([50.0, -50.0], 30)
    assert losses.mean() > 2 * TIE_SHARE * 100
    assert indistinguishable(losing(losses), FIT, WITHOUT) is tie


def test_a_few_trials_that_alone_are_against_it_leave_a_tie():
    losses = np.zeros(60)
    losses[:2] = 500.0
    assert indistinguishable(losing(losses), FIT, WITHOUT)


def test_losses_that_are_small_in_all_are_a_tie_though_every_trial_shows_them():
    little = SimpleNamespace(held_out=FIT.held_out + 1)  # what either earns is little too
    assert indistinguishable(losing(np.full(60, 0.04)), FIT, little)
    assert not indistinguishable(losing(np.full(60, 0.06)), FIT, little)


def test_a_loss_as_large_as_the_least_that_matters_matters():
    assert matters(np.array([0.0, 1.0, 2.0]) * TIE_SHARE, 1.0, 10**9).tolist() == [False, True, True]
    assert matters(np.array([0.5, 1.0, 2.0]) * TIE_LOSS, 0.0, 1).tolist() == [False, True, True]


@pytest.mark.parametrize(("trials", "lose", "tie"), [(60, 45, True), (60, 46, False), (100, 70, True), (100, 71, False)])
def test_trials_that_lose_are_no_luck_beyond_four_standard_deviations_of_heads_and_tails(trials, lose, tie):
    """Heads less tails of 60 coins have a standard deviation of √60: 30 are less than four of them, 32 are more."""
    losses = np.where(np.arange(trials) < lose, 1.0, -1.0)
    losses[0] = 3000.0  # the mean says nothing
    tried, fit, without = (SimpleNamespace(held_out=lost) for lost in (losses, np.zeros(trials), np.full(trials, 100.0)))
    assert indistinguishable(tried, fit, without) is tie
