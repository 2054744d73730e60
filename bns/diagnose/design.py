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

POOL = 160
GENERATIONS = 3
MOST_TIMES = 3
"""A trial is driven this often at most: a world that is like neither rival shows in many different trials, not in one."""
SCALE = 8.0
"""Separation from which on more of it counts less and less: a pair that is nearly decided must not take all the time."""


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
        both = {p: (_joined(ab, other.found[p][0]), _joined(ba, other.found[p][1])) for p, (ab, ba) in self.found.items()}
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
    trials: int,
    tick: Callable[[str], None] = lambda _: None,
) -> Pool:
    """``trials`` trials, the most telling first; fewer where nothing stays inside the arena."""
    base_m = rivals[0].fit.model.wheelbase_m
    tick("random trials")
    pool = random_pool(rng, rivals, stage, bounds, POOL // 2)
    pool = pool.joined(looked_at(rivals, drawn(rng, POOL, bounds, stage.arena, base_m, extreme(bounds)), stage))
    for generation in range(GENERATIONS):
        if not len(pool.plan):
            break
        tick(f"generation {generation + 1} of {GENERATIONS}")
        best = np.unique(chosen(pool, min(trials, POOL // 8)))
        parents = pool.plan.only(np.resize(best, POOL // 2))
        pool = pool.joined(looked_at(rivals, varied(rng, parents, bounds, extreme(bounds)), stage))
    return pool.only(chosen(pool, trials))


def chosen(pool: Pool, trials: int) -> NDArray[np.int64]:
    """Which trials, one after the other, each the one that adds most a minute to what is there already."""
    lasts = pool.plan.lasting_s
    directions = [one for both in pool.found.values() for one in both]
    sums = [(0.0, np.zeros_like(d.pull[0]), np.zeros_like(d.give[0])) for d in directions] if len(lasts) else []
    times = np.zeros(len(lasts), dtype=np.int64)
    out: list[int] = []
    while len(out) < trials and (times < MOST_TIMES).any():
        worth = np.zeros(len(lasts))
        for d, (square, pull, give) in zip(directions, sums, strict=True):
            before, after = d.of(square, pull, give), _with_each(d, square, pull, give)
            worth += np.log1p(after / SCALE) - np.log1p(before / SCALE)
        worth = np.where(times < MOST_TIMES, worth / lasts, -np.inf)
        best = int(np.argmax(worth))
        times[best] += 1
        out.append(best)
        sums = [
            (s + d.square[best], g + d.pull[best], m + d.give[best]) for d, (s, g, m) in zip(directions, sums, strict=True)
        ]
    return np.array(out, dtype=np.int64)


def _with_each(d: Apart, square: float, pull: Array, give: Array) -> Array:
    """The separation with each trial added in turn, (trials,)."""
    s, g, m = square + d.square, pull + d.pull, d.prior + give + d.give
    size = g.shape[1]
    if not size:
        return s
    scale = np.sqrt(np.maximum(np.einsum("tpp->tp", m), 1e-300))
    scaled = m / scale[:, :, None] / scale[:, None, :] + 1e-10 * np.eye(size)
    solved = np.linalg.solve(scaled, (g / scale)[..., None])[..., 0]
    out: Array = np.maximum(s - (g / scale * solved).sum(axis=1), 0.0)
    return out


def _joined(a: Apart, b: Apart) -> Apart:
    return Apart(
        np.concatenate([a.square, b.square]),
        np.concatenate([a.pull, b.pull]),
        np.concatenate([a.give, b.give]),
        a.prior,
    )
