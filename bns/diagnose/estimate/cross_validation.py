"""Errors on trials held out: each fifth of the trials is predicted by a model fitted to the other four."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Problem
from bns.diagnose.estimate.noise import Filter
from bns.diagnose.estimate.parallel import each
from bns.diagnose.estimate.trial_clock_test import steps_of
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.predict.horizons import HORIZONS, Errors, errors_of
from bns.physics.model import Model

FOLDS = 5


def held_out_steps(predictor: Predictor, pose_filter: Filter, model: Model) -> Steps:
    """Steps of every trial under the model's effects, their numbers fitted to the trials of the other folds.

    What belongs to one trial alone (its clock) is set as `trial_clock_test` says: by other poses of that trial.
    """
    trials = len(predictor.tracks)
    if not model.effects or trials < 2:
        return predictor.steps(model)
    fold = np.arange(trials) % min(FOLDS, trials)
    held_out = [(fold == one)[predictor.tracks.trial] for one in np.unique(fold)]

    def predicted(frames: NDArray[np.bool_]) -> Steps:
        fitted = Problem(predictor, pose_filter, (~frames).astype(float)).fit(model).model
        return steps_of(predictor, pose_filter, fitted)

    body, drift = np.zeros((len(predictor.tracks.t_s), 3)), np.zeros((len(predictor.tracks.t_s), 2))
    for frames, steps in zip(held_out, each(predicted, held_out), strict=True):
        body[frames], drift[frames] = steps.body[frames], steps.drift_m[frames]
    return Steps(body, drift)


def counted(position_m: Array) -> NDArray[np.bool_]:
    """Windows that count: those beyond six times the median are marker faults, not the model's; (windows,)."""
    kept: NDArray[np.bool_] = position_m <= 6 * max(float(np.median(position_m)), 1e-12)
    return kept


def position_error(errors: Errors) -> float:
    """Root mean square distance of the windows that count."""
    position: Array = errors.position_m
    if not len(position):
        return float("nan")
    kept = position[counted(position)]
    return float(np.sqrt((kept * kept).mean()))


def errors_at_horizons(predictor: Predictor, steps: Steps) -> Mapping[str, float]:
    """`position_error` at every horizon."""
    return {h: position_error(errors_of(predictor, steps, h)) for h in HORIZONS}
