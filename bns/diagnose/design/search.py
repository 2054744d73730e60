"""The search for the trials that drive rivals apart: a pool drawn at random, the best set of it, its children, again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.design.competing_models import Rival
from bns.diagnose.design.discrimination import Apart, Pair, Stage, apart
from bns.diagnose.design.power import Past
from bns.diagnose.design.sequences import Bounds, Sequences, brief, drawn, extreme, uniform, varied

POOL = 200
GENERATIONS = 4
MOST_TIMES = 3
"""A trial is driven this often at most: a world that is like neither rival shows in many different trials, not in one."""
PLACING_S = 10.0
"""What placing the robot for a trial is reckoned at when trials of different lengths are weighed."""
SCALE, ENOUGH, URGENT = 8.0, 20.0, 4.0
"""Separation from which on more of it counts less and less; separation that nearly decides, and how much reaching it counts: a
pair that is decided must not take the time of one that is not."""


@dataclass(frozen=True)
class Pool:
    """Trials that were looked at, and what each does for every pair in both directions."""

    plan: Sequences
    found: Mapping[Pair, tuple[Apart, Apart]]

    def only(self, chosen: NDArray[np.int64]) -> Pool:
        """Some of the trials."""
        return Pool(self.plan.only(chosen), {p: (ab.only(chosen), ba.only(chosen)) for p, (ab, ba) in self.found.items()})

    def joined(self, other: Pool) -> Pool:
        """These trials, then the other's."""
        both = {p: (ab.joined(other.found[p][0]), ba.joined(other.found[p][1])) for p, (ab, ba) in self.found.items()}
        return Pool(self.plan.joined(other.plan), both)


def looked_at(rivals: Sequence[Rival], plan: Sequences, stage: Stage) -> Pool:
    """The trials of a plan that last and that stay inside the arena under every rival."""
    found, inside = apart(rivals, plan, stage)
    kept = np.flatnonzero(inside & (plan.lasting_s > 0))
    return Pool(plan, found).only(kept)


def random_pool(rng: np.random.Generator, rivals: Sequence[Rival], stage: Stage, bounds: Bounds, count: int) -> Pool:
    """Plain random trials: what a proposal is measured against."""
    base_m = rivals[0].fit.model.wheelbase_m
    return looked_at(rivals, drawn(rng, count, bounds, stage.arena, base_m, uniform(bounds)), stage)


def designed(
    rng: np.random.Generator,
    rivals: Sequence[Rival],
    stage: Stage,
    bounds: Bounds,
    seconds: float,
    past: Mapping[Pair, Past],
    tick: Callable[[str], None] = lambda _: None,
) -> Pool:
    """Trials that last ``seconds`` together, the most telling first; none where nothing stays inside the arena."""
    base_m = rivals[0].fit.model.wheelbase_m
    tick("random trials")
    pool = random_pool(rng, rivals, stage, bounds, POOL // 2)
    corners = drawn(rng, POOL, bounds, stage.arena, base_m, extreme(bounds), brief(rng, bounds, POOL))
    pool = pool.joined(looked_at(rivals, corners, stage))
    for generation in range(GENERATIONS):
        if not len(pool.plan):
            break
        tick(f"generation {generation + 1} of {GENERATIONS}")
        best = np.unique(chosen(pool, min(seconds, POOL / 8 * bounds.trial_s), past))
        parents = pool.plan.only(np.resize(best, POOL // 2))
        pool = pool.joined(looked_at(rivals, varied(rng, parents, bounds, extreme(bounds)), stage))
    return pool.only(chosen(pool, seconds, past))


def chosen(pool: Pool, seconds: float, past: Mapping[Pair, Past]) -> NDArray[np.int64]:
    """Which trials, until so many seconds are full: one by one, always the one that adds most a minute, placing included."""
    lasts = pool.plan.lasting_s
    directions = [(one, past[pair]) for pair, both in pool.found.items() for one in both] if len(lasts) else []
    sums = [_Sums(*(np.zeros_like(part[:1]) for part in (d.square, d.pull, d.give))) for d, _ in directions]
    times = np.zeros(len(lasts), dtype=np.int64)
    out: list[int] = []
    while lasts[out].sum() < seconds * (1 - 1e-9) and (times < MOST_TIMES).any():
        worth = np.zeros(len(lasts))
        more = [so_far.with_each(d) for (d, _), so_far in zip(directions, sums, strict=True)]
        for (_, before), each, so_far in zip(directions, more, sums, strict=True):
            worth += _worth(before.telling(each.total, each.squares)) - _worth(before.telling(so_far.total, so_far.squares))
        worth = np.where(times < MOST_TIMES, worth / (lasts + PLACING_S), -np.inf)
        best = int(np.argmax(worth))
        times[best] += 1
        out.append(best)
        sums = [each.only(best) for each in more]
    return np.array(out, dtype=np.int64)


@dataclass(frozen=True)
class _Sums:
    """What sets of trials do in one direction, (sets, ...): the sums of `Apart`, the separation of all, the squares of what each
    trial added to it."""

    square: Array
    pull: Array
    give: Array
    total: Array = field(default_factory=lambda: np.zeros(1))
    squares: Array = field(default_factory=lambda: np.zeros(1))

    def with_each(self, d: Apart) -> _Sums:
        """This one set, with each of the trials."""
        sums = (self.square + d.square, self.pull + d.pull, self.give + d.give)
        total = d.of(*sums)
        return _Sums(*sums, total, self.squares + (total - self.total) ** 2)

    def only(self, chosen: int) -> _Sums:
        """One of the sets."""
        return _Sums(*(np.asarray(part[chosen])[None] for part in (self.square, self.pull, self.give, self.total, self.squares)))


def _worth(separation: Array) -> Array:
    """What a separation counts: it rises towards a decision, and beyond it hardly."""
    return np.asarray(np.log1p(separation / SCALE) - URGENT * np.exp(-separation / ENOUGH))
