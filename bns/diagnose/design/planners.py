"""What plans an experiment: of robots on wheels new commands, of robots on joints cycles that tell most."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from bns.diagnose.design.competing_models import CompetingModel
from bns.diagnose.design.discrimination import Discrimination, ExperimentSetup, Pair, discriminations
from bns.diagnose.design.limits import START
from bns.diagnose.design.power import PastTrials
from bns.diagnose.design.search import Pool, design_trials, random_pool
from bns.diagnose.design.sequences import Bounds
from bns.errors import DataError, in_both

Both = tuple[Discrimination, Discrimination]


class Planner(Protocol):
    """Trials that a robot can drive, and what each does to tell models apart. ``pairs``: of models, by their places."""

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Which models are compared with each other."""

    def best(
        self, rng: np.random.Generator, models: Sequence[CompetingModel], seconds: float, past: Mapping[Pair, PastTrials]
    ) -> Pool:
        """Trials that last ``seconds`` together, the most telling first; DataError where there are none."""

    def random(self, rng: np.random.Generator, models: Sequence[CompetingModel], count: int) -> Pool:
        """Trials by lot: what the best are measured against."""

    def discriminations(
        self, models: Sequence[CompetingModel], plan: Any, pairs: tuple[Pair, ...]
    ) -> Mapping[Pair, Both]:
        """Both directions of pairs of models over a plan's trials."""


@dataclass(frozen=True)
class WheelPlanner:
    """Sequences of commands inside an arena."""

    setup: ExperimentSetup
    bounds: Bounds
    tick: Callable[[str], None] = lambda _: None

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """As of `Planner`."""
        return self.setup.pairs

    def best(
        self, rng: np.random.Generator, models: Sequence[CompetingModel], seconds: float, past: Mapping[Pair, PastTrials]
    ) -> Pool:
        """As of `Planner`."""
        best = design_trials(rng, models, self.setup, self.bounds, seconds, past, self.tick)
        if not len(best.plan):
            start = self.setup.arena.start
            raise DataError(
                f"No trial of {self.bounds.trial_s:g} s stays inside the arena from its start at x = {start[0]:.2f}, y = "
                f"{start[1]:.2f} m. Give a larger one, {in_both('--arena 2x1.5', 'arena=(2, 1.5)')}, or another start, {START}."
            )
        return best

    def random(self, rng: np.random.Generator, models: Sequence[CompetingModel], count: int) -> Pool:
        """As of `Planner`."""
        return random_pool(rng, models, self.setup, self.bounds, count)

    def discriminations(
        self, models: Sequence[CompetingModel], plan: Any, pairs: tuple[Pair, ...]
    ) -> Mapping[Pair, Both]:
        """As of `Planner`."""
        return discriminations(models, plan, replace(self.setup, pairs=pairs))[0]
