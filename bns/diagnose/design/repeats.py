"""Robots on joints: which of the cycles driven so far tell competing models apart, driven once more.

Random controllers have been everywhere already, and what each explanation says of every one of their cycles is known from the
diagnosis: no body has to be simulated again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import block_diag

from bns.diagnose.data.bodies.stretches import StretchTracks
from bns.diagnose.data.tracks import Array
from bns.diagnose.design.competing_models import CompetingModel
from bns.diagnose.design.discrimination import Discrimination, Pair, curvature_of, whitened_errors
from bns.diagnose.design.power import PastTrials
from bns.diagnose.design.search import Pool, select_trials
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.normal_equations import normal_equations_by_trial
from bns.diagnose.settings import DEFAULTS

_STEP_S = DEFAULTS.design.repeat_step_s


@dataclass(frozen=True)
class Repeats:
    """Stretches of tracks to be driven once more, each a trial: ``chosen`` (trials,), any of them more than once."""

    tracks: StretchTracks
    chosen: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.chosen)

    @property
    def lasting_s(self) -> Array:
        """How long each trial takes, with what brings the joints to where they are when it begins, (trials,)."""
        drives = [self.tracks.told[i].drive(_STEP_S, np.zeros(3), 2) for i in self.chosen]
        return _STEP_S * np.array([len(drive.set_points) for drive in drives], dtype=np.float64)

    def only(self, chosen: NDArray[np.int64]) -> Repeats:
        """Some of the trials, in the order of ``chosen``."""
        return replace(self, chosen=self.chosen[chosen])

    def joined(self, others: Repeats) -> Repeats:
        """These trials, then the others."""
        return replace(self, chosen=np.concatenate([self.chosen, others.chosen]))

    def commands(self) -> pd.DataFrame:
        """The trial file: trial, and what the servos are told, as `StretchTracks` has it of these stretches."""
        tables = [pd.DataFrame(self.tracks.told[i].commands()) for i in self.chosen]
        for trial, table in enumerate(tables):
            table.insert(0, "trial", trial)
        return pd.concat(tables, ignore_index=True).round(5) if tables else pd.DataFrame({"trial": []})


@dataclass(frozen=True)
class RepeatPlanner:
    """As `wheel_planner.WheelPlanner`, for the stretches of a problem."""

    problem: Problem
    pairs: tuple[Pair, ...]

    def best(
        self, rng: np.random.Generator, models: Sequence[CompetingModel], seconds: float, past: Mapping[Pair, PastTrials]
    ) -> Pool:
        """Trials that last ``seconds`` together, the most telling first."""
        pool = self._pool(models, np.arange(len(self._tracks.told)))
        return pool.only(select_trials(pool, seconds, past))

    def random(self, rng: np.random.Generator, models: Sequence[CompetingModel], count: int) -> Pool:
        """Any of the stretches, by lot."""
        return self._pool(models, rng.integers(len(self._tracks.told), size=count))

    def discriminations(
        self, models: Sequence[CompetingModel], plan: Repeats, pairs: tuple[Pair, ...]
    ) -> Mapping[Pair, tuple[Discrimination, Discrimination]]:
        """Both directions of pairs of models over a plan's trials."""
        errors = [whitened_errors(self.problem, model.fit.model) for model in models]
        first = np.append(self._tracks.begins, len(self._tracks.t_s))

        def direction(true: int, other: int) -> Discrimination:
            error = errors[other][0] - errors[true][0]
            jacobian = np.concatenate([errors[other][1], errors[true][1]], axis=2)
            equations = normal_equations_by_trial(first, jacobian, error)
            of_other, of_true = models[other].fit, models[true].fit
            return Discrimination(
                np.add.reduceat(2 * huber(error), first[:-1]),
                equations.gradients,
                equations.curvatures,
                block_diag(curvature_of(of_other), curvature_of(of_true)),
                of_true.covariance,
                len(of_other.free),
                np.diff(first) * float(error.shape[1]),
            ).only(plan.chosen)

        return {(a, b): (direction(a, b), direction(b, a)) for a, b in pairs}

    @property
    def _tracks(self) -> StretchTracks:
        tracks = self.problem.predictor.tracks
        assert isinstance(tracks, StretchTracks)
        return tracks

    def _pool(self, models: Sequence[CompetingModel], chosen: NDArray[np.int64]) -> Pool:
        plan = Repeats(self._tracks, chosen)
        return Pool(plan, self.discriminations(models, plan, self.pairs))
