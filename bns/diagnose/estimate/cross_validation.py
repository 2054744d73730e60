"""Errors on trials held out: each fifth of the trials is predicted by a model fitted to the other four."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Tracks
from bns.diagnose.estimate.clocks.trial_clock_test import steps_of
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import Whitening
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.paired_errors import PairedErrors, paired_errors
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

FOLDS = DEFAULTS.estimate.folds
AS_GIVEN = "as given"
"""The name of the model that was handed in, in tables of errors."""


def held_out_steps(predictor: Predictor, pose_filter: Whitening, model: Model) -> Steps:
    """Steps of every trial under the model's effects, their numbers fitted to the trials of the other folds.

    What belongs to one trial alone (its clock) is set as `trial_clock_test` says: by other poses of that trial.
    """
    trials = len(predictor.tracks)
    if not model.effects or trials < 2:
        return predictor.steps(model)
    fold = folds(predictor.tracks)
    held_out = [(fold == one)[predictor.tracks.trial] for one in np.unique(fold)]

    def predicted(frames: NDArray[np.bool_]) -> Steps:
        counted = (~frames).astype(float) * (1.0 if predictor.counted is None else predictor.counted)
        fitted = Problem(predictor, pose_filter, counted).fit(model).model
        return steps_of(predictor, pose_filter, fitted)

    body, drift = np.zeros((len(predictor.tracks.t_s), 3)), np.zeros((len(predictor.tracks.t_s), 2))
    apart = None
    for frames, steps in zip(held_out, each(predicted, held_out), strict=True):
        body[frames], drift[frames] = steps.body[frames], steps.drift_m[frames]
        if steps.apart_m is not None:
            apart = np.zeros_like(steps.apart_m) if apart is None else apart
            apart[frames] = steps.apart_m[frames]
    return Steps(body, drift, apart)


def folds(tracks: Tracks) -> NDArray[np.int64]:
    """Which fold each trial is held out with, (trials,): every fifth of them.

    Pieces of one trial share what was peculiar to it, so that they are held out together; those of a single one in five blocks.
    """
    if tracks.lead_s is None:
        return np.arange(len(tracks)) % min(FOLDS, len(tracks))
    of = whole_trials(tracks)
    return of % FOLDS if of[-1] > 0 else np.arange(len(tracks)) * min(FOLDS, len(tracks)) // len(tracks)


def whole_trials(tracks: Tracks) -> NDArray[np.int64]:
    """Number of the trial that each is, or is a piece of, (trials,)."""
    if tracks.lead_s is None:
        return np.arange(len(tracks))
    return np.cumsum(np.append(True, tracks.lead_s[1:] <= 0.0)) - 1


@dataclass(frozen=True)
class Judged:
    """A model whose numbers were fitted, by a name, and the filter of the problem that they were fitted to.

    ``steps``: what `held_out_steps` gives of it, where that was worked out already.
    """

    name: str
    model: Model
    pose_filter: Whitening
    steps: Steps | None = None

    def held_out(self, predictor: Predictor) -> Steps:
        """What is predicted of every trial by a fit to others."""
        return held_out_steps(predictor, self.pose_filter, self.model) if self.steps is None else self.steps


def judged_errors(predictor: Predictor, pose_filter: Whitening, given: Model, extended: Sequence[Judged]) -> PairedErrors:
    """Errors of a model as given, and of models whose numbers were fitted, each on trials held out; all on the same windows.

    The first one is `AS_GIVEN`: what `bns compare` shows of the same model and data.
    """
    steps = [(AS_GIVEN, steps_of(predictor, pose_filter, given))]
    steps += [(one.name, one.held_out(predictor)) for one in extended]
    return paired_errors(predictor, steps)
