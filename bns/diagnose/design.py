"""The search for the trials that drive rivals apart: a pool drawn at random, the best set of it, its children, again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.rivals import Rival
from bns.diagnose.separation import Apart, Pair, Stage, apart
from bns.diagnose.sequences import Bounds, Sequences, drawn, extreme, uniform, varied
from bns.diagnose.tracks import Array

POOL = 200
GENERATIONS = 4
MOST_TIMES = 3
"""A trial is driven this often at most: a world that is like neither rival shows in many different trials, not in one."""
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
    tick: Callable[[str], None] = lambda _: None,
) -> Pool:
    """Trials that last ``seconds`` together, the most telling first; none where nothing stays inside the arena."""
    base_m = rivals[0].fit.model.wheelbase_m
    tick("random trials")
    pool = random_pool(rng, rivals, stage, bounds, POOL // 2)
    pool = pool.joined(looked_at(rivals, drawn(rng, POOL, bounds, stage.arena, base_m, extreme(bounds)), stage))
    for generation in range(GENERATIONS):
        if not len(pool.plan):
            break
        tick(f"generation {generation + 1} of {GENERATIONS}")
        best = np.unique(chosen(pool, min(seconds, POOL / 8 * bounds.trial_s)))
        parents = pool.plan.only(np.resize(best, POOL // 2))
        pool = pool.joined(looked_at(rivals, varied(rng, parents, bounds, extreme(bounds)), stage))
    return pool.only(chosen(pool, seconds))


def chosen(pool: Pool, seconds: float) -> NDArray[np.int64]:
    """Which trials, until so many seconds are full: one after the other, each the one that adds most a minute."""
    lasts = pool.plan.lasting_s
    directions = [one for both in pool.found.values() for one in both] if len(lasts) else []
    sums = [tuple(np.zeros_like(part[0]) for part in (d.square, d.pull, d.give)) for d in directions]
    times = np.zeros(len(lasts), dtype=np.int64)
    out: list[int] = []
    while lasts[out].sum() < seconds * (1 - 1e-9) and (times < MOST_TIMES).any():
        worth = np.zeros(len(lasts))
        for d, (s, g, m) in zip(directions, sums, strict=True):
            worth += _worth(d.of(s + d.square, g + d.pull, m + d.give)) - _worth(d.of(s[None], g[None], m[None]))
        worth = np.where(times < MOST_TIMES, worth / lasts, -np.inf)
        best = int(np.argmax(worth))
        times[best] += 1
        out.append(best)
        sums = [
            (s + d.square[best], g + d.pull[best], m + d.give[best]) for d, (s, g, m) in zip(directions, sums, strict=True)
        ]
    return np.array(out, dtype=np.int64)


def _worth(separation: Array) -> Array:
    """What a separation counts: it rises towards a decision, and beyond it hardly."""
    return np.asarray(np.log1p(separation / SCALE) - URGENT * np.exp(-separation / ENOUGH))
