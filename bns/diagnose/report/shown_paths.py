"""The paths that a report shows: measured, and predicted before and after, thinned to what a screen can show."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bns.diagnose.data.tracks import Array
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.horizons import laid_paths
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

MOST_TRIALS = DEFAULTS.report.most_trials
MOST_POSES = DEFAULTS.report.most_poses
_STRANGE = DEFAULTS.report.strange


def shown_paths(predictor: Predictor, model: Model, d: Diagnosis) -> list[dict[str, Any]]:
    """One entry a trial: name, t (s), and x, y (mm) measured, before, after ("after" only where something was accepted).

    First those in which the extended model is more right by most; without one, the worst predicted. What comes after is predicted
    for each trial by a model fitted to others.
    """
    tracks = predictor.tracks
    before = laid_paths(tracks, predictor.steps(model))
    after = None
    if d.selection is not None and d.model is not None and d.effects:
        after = laid_paths(tracks, held_out_steps(predictor, d.selection.problem.pose_filter, d.selection.fit.model))
    elif d.formula is not None and d.selection is not None:
        pose_filter = problem_for(predictor, d.formula.fit.model).pose_filter
        after = laid_paths(tracks, held_out_steps(predictor, pose_filter, d.formula.fit.model))
    off = _mean_error(predictor, before)
    strange = off > _STRANGE * np.median(off)
    better = off - (_mean_error(predictor, after) if after is not None else 0.0)
    order = np.lexsort([-better, strange])
    count = min(len(order), MOST_TRIALS)
    chosen = order[np.unique(np.linspace(0, len(order) - 1, count).round().astype(int))]
    return [_trial(predictor, int(trial), before, after) for trial in chosen]


def _mean_error(predictor: Predictor, poses: Array) -> Array:
    """Mean distance of predictions from measurements in each trial, (trials,)."""
    tracks = predictor.tracks
    error = np.hypot(*(poses - tracks.pose)[:, :2].T)
    return np.asarray(np.add.reduceat(error, tracks.first[:-1]) / np.diff(tracks.first))


def _trial(predictor: Predictor, trial: int, before: Array, after: Array | None) -> dict[str, Any]:
    tracks = predictor.tracks
    first, last = int(tracks.first[trial]), int(tracks.first[trial + 1])
    rows = np.unique(np.linspace(first, last - 1, min(last - first, MOST_POSES)).round().astype(int))
    shown = {"name": tracks.names[trial], "t": [round(float(t), 2) for t in tracks.own_s[rows]]}
    parts = {"measured": tracks.pose, "before": before} | ({"after": after} if after is not None else {})
    return {**shown, **{name: _flat(poses, rows) for name, poses in parts.items()}}


def _flat(poses: Array, rows: NDArray[np.int64]) -> list[int]:
    """x and y in turn, in millimetres."""
    return [int(v) for v in np.round(1e3 * poses[rows, :2]).ravel()]
