"""How likely it is that the diagnosis decides between two explanations once planned trials have been driven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.select.indistinguishable import TIE_SHARE, TIE_Z, matters
from bns.diagnose.settings import DEFAULTS

DRAWS = DEFAULTS.design.power_draws
TARGET_POWER = DEFAULTS.design.target_power
LONGEST_MINUTES = DEFAULTS.design.longest_minutes
MOST_REPEATS = DEFAULTS.design.most_repeats


@dataclass(frozen=True)
class ExpectedGain:
    """What a true explanation is expected to earn over another: ``old`` (trials,) so far, ``new`` (planned,) discriminations.

    ``worth_old``, ``worth_new``: likewise over the model without it, which the diagnosis' share is taken of. ``scatter``:
    variance of a trial's gain over what unit noise gives.
    ``chance``: that this explanation is the true one of the two, by what was seen so far.
    """

    old: Array
    new: Array
    worth_old: Array
    worth_new: Array
    scatter: float = 1.0
    chance: float = 0.5

    def first(self, trials: int) -> ExpectedGain:
        """With so many of the planned trials; of more than there are, these again and again."""
        new, worth = np.resize(self.new, trials), np.resize(self.worth_new, trials)
        return ExpectedGain(self.old, new, self.worth_old, worth, self.scatter, self.chance)


@dataclass(frozen=True)
class PastTrials:
    """Of the trials seen so far, for a pair of explanations: squares of their gains about the mean,
    and by what factor these are overdispersed."""

    squares: float = 0.0
    scatter: float = 1.0

    def effective_discrimination(self, total: Array, squares: Array) -> Array:
        """The discrimination that counts, of trials with discriminations s, ``total`` = sum s, ``squares`` = sum s^2.

        The diagnosis judges a gain by how it varies between trials: (sum s / 2)^2 over (what is expected of) its squared standard
        error, times four; without past trials, and each new one telling little, this is sum s itself. One trial that
        tells a lot counts 4, whatever it tells: nobody knows whether the next would.
        """
        return np.asarray(total**2 / np.maximum(self.squares + squares / 4 + self.scatter * total, 1e-12))


def distinguished(gain: Array, se: Array, worth: float, trials: int) -> NDArray[np.bool_]:
    """The diagnosis' own criterion: is a gain over a competing model (a trial, with its standard error) more than a tie?"""
    return np.asarray((gain >= TIE_Z * se) & matters(gain, worth, trials))


def power(expected: ExpectedGain, seed: int = 0) -> float:
    """Chance that old and new trials together decide by the diagnosis' own criterion of a tie.

    A discrimination s gives a trial a gain of mean s/2 and variance s (times the scatter).
    """
    rng = np.random.default_rng(seed)
    new = expected.new / 2 + np.sqrt(expected.scatter * expected.new) * rng.normal(size=(DRAWS, len(expected.new)))
    old = np.tile(expected.old, (DRAWS, 1))
    gains = np.concatenate([old, new], axis=1)
    trials = gains.shape[1]
    if trials < 2:
        return 0.0
    mean, se = gains.mean(axis=1), gains.std(axis=1, ddof=1) / np.sqrt(trials)
    worth = (expected.worth_old.sum() + expected.worth_new.sum() / 2) / trials
    return float(distinguished(mean, se, worth, trials).mean())


def expected_standard_errors(expected: ExpectedGain) -> float:
    """The gain that old and new trials together are expected to show, in its own standard errors; 0 of fewer than two trials.

    The diagnosis calls a pair decided from `TIE_Z` of them on.
    """
    trials = len(expected.old) + len(expected.new)
    if trials < 2:
        return 0.0
    means = np.concatenate([expected.old, expected.new / 2])
    squares = float(((means - means.mean()) ** 2).sum() + expected.scatter * expected.new.sum())
    return float(means.sum() / np.sqrt(max(squares * trials / (trials - 1), 1e-12)))


def decision_probability(both: Sequence[ExpectedGain]) -> float:
    """`power` whichever of two explanations is true, weighed by their chances."""
    return sum(e.chance * power(e) for e in both)


def negligible_difference(both: Sequence[ExpectedGain]) -> bool:
    """Is the difference, however sure it may become, a smaller share of what either earns than the diagnosis counts?"""
    return all(float(e.new.sum()) < TIE_SHARE * float(e.worth_new.sum()) for e in both)


def overdispersion_of(gains: Array, discriminations: Array) -> float:
    """How much more the gains of trials seen so far vary than unit noise lets them, at least 1.

    Noise of the robot that comes and goes from trial to trial is in them, as it will be in the new ones.
    """
    by_noise = float(discriminations.mean())
    return max(float(gains.var(ddof=1)) / by_noise, 1.0) if by_noise > 1e-9 and len(gains) > 2 else 1.0


def least_minutes(both: Sequence[ExpectedGain], lasting_s: Array) -> float:
    """How long a plan that does not suffice has to be driven, again and again (min), until nine in ten decide; else 0."""
    if not len(lasting_s) or decision_probability([e.first(0) for e in both]) >= TARGET_POWER:
        return 0.0

    def minutes(trials: int) -> float:
        return float(np.resize(lasting_s, trials).sum() / 60)

    def decides(trials: int) -> bool:
        return decision_probability([e.first(trials) for e in both]) >= TARGET_POWER

    low, high = 0, len(lasting_s)
    while not decides(high):
        low, high = high, 2 * high
        if minutes(high) > LONGEST_MINUTES or high > MOST_REPEATS * len(lasting_s):
            return LONGEST_MINUTES
    while low and high - low > max(low // 50, 1):
        middle = (low + high) // 2
        low, high = (low, middle) if decides(middle) else (middle, high)
    return min(minutes(high), LONGEST_MINUTES) if low else 0.0


def minutes_needed(discrimination: float, minutes: float, scatter: float) -> float:
    """Robot time (min) until nine in ten such experiments decide: the mean gain is then TIE_Z + 1.28 standard errors."""
    needed = 4 * (TIE_Z + 1.28) ** 2 * scatter
    return minutes * needed / discrimination if discrimination > 0 else np.inf
