"""The search for the trials that drive competing models apart: a random pool, the best set of it, its children, again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.design.competing_models import CompetingModel
from bns.diagnose.design.discrimination import Discrimination, ExperimentSetup, Pair, discriminations
from bns.diagnose.design.power import PastTrials
from bns.diagnose.design.sequences import (
    Bounds,
    Plan,
    Sequences,
    draw_sequences,
    extreme,
    mutate_sequences,
    short_durations,
    uniform,
)
from bns.diagnose.settings import DEFAULTS

POOL = DEFAULTS.design.pool
GENERATIONS = DEFAULTS.design.generations
MOST_TIMES = DEFAULTS.design.most_times
PLACING_S = DEFAULTS.design.placing_s
SCALE = DEFAULTS.design.scale
ENOUGH = DEFAULTS.design.enough
URGENT = DEFAULTS.design.urgent


@dataclass(frozen=True)
class Pool:
    """Trials that were evaluated, and what each does for every pair in both directions."""

    plan: Plan
    discriminations: Mapping[Pair, tuple[Discrimination, Discrimination]]

    def only(self, chosen: NDArray[np.int64]) -> Pool:
        """Some of the trials."""
        return Pool(
            self.plan.only(chosen),
            {p: (ab.only(chosen), ba.only(chosen)) for p, (ab, ba) in self.discriminations.items()},
        )

    def joined(self, other: Pool) -> Pool:
        """These trials, then the other's."""
        both = {
            p: (ab.joined(other.discriminations[p][0]), ba.joined(other.discriminations[p][1]))
            for p, (ab, ba) in self.discriminations.items()
        }
        return Pool(self.plan.joined(other.plan), both)


def evaluated(competing_models: Sequence[CompetingModel], plan: Sequences, setup: ExperimentSetup) -> Pool:
    """The trials of a plan that last and that stay inside the arena under every competing model."""
    result, inside = discriminations(competing_models, plan, setup)
    kept = np.flatnonzero(inside & (plan.lasting_s > 0))
    return Pool(plan, result).only(kept)


def random_pool(
    rng: np.random.Generator,
    competing_models: Sequence[CompetingModel],
    setup: ExperimentSetup,
    bounds: Bounds,
    count: int,
) -> Pool:
    """Plain random trials: what a proposal is measured against."""
    base_m = competing_models[0].fit.model.wheelbase_m
    return evaluated(competing_models, draw_sequences(rng, count, bounds, setup.arena, base_m, uniform(bounds)), setup)


def design_trials(
    rng: np.random.Generator,
    competing_models: Sequence[CompetingModel],
    setup: ExperimentSetup,
    bounds: Bounds,
    seconds: float,
    past: Mapping[Pair, PastTrials],
    tick: Callable[[str], None] = lambda _: None,
) -> Pool:
    """Trials that last ``seconds`` together, the most telling first; none where nothing stays inside the arena."""
    base_m = competing_models[0].fit.model.wheelbase_m
    tick("random trials")
    pool = random_pool(rng, competing_models, setup, bounds, POOL // 2)
    corners = draw_sequences(
        rng, POOL, bounds, setup.arena, base_m, extreme(bounds), short_durations(rng, bounds, POOL)
    )
    pool = pool.joined(evaluated(competing_models, corners, setup))
    for generation in range(GENERATIONS):
        if not len(pool.plan):
            break
        tick(f"generation {generation + 1} of {GENERATIONS}")
        best = np.unique(select_trials(pool, min(seconds, POOL / 8 * bounds.trial_s), past))
        parents = pool.plan.only(np.resize(best, POOL // 2))
        assert isinstance(parents, Sequences)
        pool = pool.joined(evaluated(competing_models, mutate_sequences(rng, parents, bounds, extreme(bounds)), setup))
    return pool.only(select_trials(pool, seconds, past))


def select_trials(pool: Pool, seconds: float, past: Mapping[Pair, PastTrials]) -> NDArray[np.int64]:
    """Which trials, until so many seconds are full: one by one, always the one that adds most a minute, placing included."""
    lasts = pool.plan.lasting_s
    directions = (
        [(one, past[pair]) for pair, both in pool.discriminations.items() for one in both] if len(lasts) else []
    )
    sums = [_Sums(*(np.zeros_like(part[:1]) for part in (d.squared, d.gradient, d.information))) for d, _ in directions]
    times = np.zeros(len(lasts), dtype=np.int64)
    out: list[int] = []
    while lasts[out].sum() < seconds * (1 - 1e-9) and (times < MOST_TIMES).any():
        worth = np.zeros(len(lasts))
        more = [so_far.with_each(d) for (d, _), so_far in zip(directions, sums, strict=True)]
        for (_, before), each, so_far in zip(directions, more, sums, strict=True):
            worth += _worth(before.effective_discrimination(each.total, each.squares)) - _worth(
                before.effective_discrimination(so_far.total, so_far.squares)
            )
        worth = np.where(times < MOST_TIMES, worth / (lasts + PLACING_S), -np.inf)
        best = int(np.argmax(worth))
        times[best] += 1
        out.append(best)
        sums = [each.only(best) for each in more]
    return np.array(out, dtype=np.int64)


@dataclass(frozen=True)
class _Sums:
    """What sets of trials do in one direction, (sets, ...): the sums of `Discrimination`, the discrimination of all, the squares
    of what each trial added to it."""

    squared: Array
    gradient: Array
    information: Array
    total: Array = field(default_factory=lambda: np.zeros(1))
    squares: Array = field(default_factory=lambda: np.zeros(1))

    def with_each(self, d: Discrimination) -> _Sums:
        """This one set, with each of the trials."""
        sums = (self.squared + d.squared, self.gradient + d.gradient, self.information + d.information)
        total = d.of(*sums)
        return _Sums(*sums, total, self.squares + (total - self.total) ** 2)

    def only(self, chosen: int) -> _Sums:
        """One of the sets."""
        return _Sums(
            *(
                np.asarray(part[chosen])[None]
                for part in (self.squared, self.gradient, self.information, self.total, self.squares)
            )
        )


def _worth(discrimination: Array) -> Array:
    """What a discrimination counts: it rises towards a decision, and beyond it hardly."""
    return np.asarray(np.log1p(discrimination / SCALE) - URGENT * np.exp(-discrimination / ENOUGH))
