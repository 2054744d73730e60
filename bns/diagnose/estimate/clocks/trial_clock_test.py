"""Do the clocks differ from trial to trial? Judged on poses that had no part in setting them.

A trial's offset cannot be foreseen from other trials, so "held out" means something else here: a trial is cut into `BLOCKS`,
and every other block is predicted with the clock that those between ask for. Never is a clock judged on poses that set it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.clocks.trial_clocks import with_fitted_clocks
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import Whitening, huber
from bns.diagnose.estimate.significance import PairedComparison, paired_elpd_diff, sign_flip_p
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

BLOCKS = DEFAULTS.estimate.clock_blocks
FEWEST_FRAMES = DEFAULTS.estimate.clock_fewest_frames
_FAR = DEFAULTS.estimate.clock_far
LEAST_SCATTER_S = DEFAULTS.estimate.clock_least_scatter_s


@dataclass(frozen=True)
class TrialClocks:
    """The fit with a clock for each trial, what that earns over one clock for all, and how far the clocks scatter (s)."""

    fit: Fit
    paired_comparison: PairedComparison
    scatter_s: float


def steps_of(predictor: Predictor, pose_filter: Whitening, model: Model) -> Steps:
    """What a model predicts; where trials have clocks of their own, each block of a trial with the clock of its neighbours."""
    return predictor.steps(model) if model.per_trial_effect is None else _crossed(predictor, pose_filter, model)[0]


def fit_trial_clocks(problem: Problem, fit: Fit) -> TrialClocks | None:
    """A fitted model with a clock for each trial; None where they hardly differ, or already differ in the model."""
    effect = next((e for e in fit.model.catalogue().values() if e.per_trial_allowed), None)
    if effect is None or fit.model.per_trial_effect is not None:
        return None
    if np.median(np.diff(problem.predictor.tracks.first)) < FEWEST_FRAMES:
        return None
    known = any(a.effect.name == effect.name for a in fit.model.effects)
    common = fit if known else fit_with(problem, fit, effect)
    apart = problem.fit(with_trial_clocks(common.model, effect.name))
    return compare_clocks(problem, common, apart)


def compare_clocks(problem: Problem, common: Fit, apart: Fit) -> TrialClocks | None:
    """What a clock for each trial earns over one for all; None where they hardly differ."""
    predictor, pose_filter = problem.predictor, problem.pose_filter
    steps, halves = _crossed(predictor, pose_filter, apart.model)
    agreed = _agreement(*halves)
    scatter = float(np.sqrt(max(agreed.mean(), 0.0)))
    if scatter < LEAST_SCATTER_S or not _plausible(apart.model):
        return None
    losses = problem.per_trial(huber(pose_filter.whitened(predictor.tracks, steps)))
    elpd_diff, dse = paired_elpd_diff(common.held_out, losses)
    # were there nothing, the halves of a trial would differ from the others' as often in opposite ways as in the same
    return TrialClocks(apart, PairedComparison(elpd_diff, dse, sign_flip_p(agreed[:, None], np.eye(1))), scatter)


def _plausible(model: Model) -> bool:
    """Do nearly all clocks lie where clocks can be? Else something that every trial has in another way was taken for one."""
    assert model.per_trial_effect is not None
    low, high = model.per_trial_effect.effect.parameters[0].plausible
    far = [not low < value < high for value in model.per_trial_effect.trial_values]
    return float(np.mean(far)) <= _FAR


def with_trial_clocks(model: Model, name: str) -> Model:
    """The model in which every trial has its own value of that effect; none is known yet."""
    return replace(
        model, effects=tuple(replace(a, per_trial=True) if a.effect.name == name else a for a in model.effects)
    )


def with_shared_clock(model: Model) -> Model:
    """The model in which the mean of the trials' clocks serves all of them."""
    return replace(model, effects=tuple(replace(a, per_trial=False, trial_values=()) for a in model.effects))


def every_other_block(tracks: Tracks) -> np.ndarray:
    """Frames in the second, fourth, ... of the `BLOCKS` of their trial, (frames,)."""
    lengths = np.diff(tracks.first)
    frame: np.ndarray = np.arange(len(tracks.t_s)) - tracks.first[tracks.trial]
    return (frame * BLOCKS // lengths[tracks.trial]) % 2 == 1


def _crossed(predictor: Predictor, pose_filter: Whitening, model: Model) -> tuple[Steps, tuple[Array, Array]]:
    """Steps with the clocks of the other blocks, and the clocks (trials,) that odd and even blocks ask for."""
    even = every_other_block(predictor.tracks)
    problems = [Problem(predictor, pose_filter, (even == which).astype(float)) for which in (False, True)]
    models = [with_fitted_clocks(problem, problem.fit(model, rounds=0).model) for problem in problems]
    of_odd, of_even = (predictor.steps(m) for m in models)
    body = np.where(even[:, None], of_odd.body, of_even.body)
    drift = np.where(even[:, None], of_odd.drift_m, of_even.drift_m)
    clocks = [np.array(m.per_trial_effect.trial_values) for m in models if m.per_trial_effect is not None]
    return Steps(body, drift), (clocks[0], clocks[1])


def _agreement(one: Array, other: Array) -> Array:
    """Products of what two halves of each trial say of its clock, about their medians, far ones clipped; (trials,).

    What the halves agree on is not noise of either: the mean is the variance of the clocks.
    """
    centred = [v - np.median(v) for v in (one, other)]
    wide = [3 * 1.4826 * float(np.median(np.abs(v))) + 1e-3 for v in centred]
    a, b = (np.clip(v, -w, w) for v, w in zip(centred, wide, strict=True))
    product: Array = a * b
    return product
