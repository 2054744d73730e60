"""Do the clocks differ from trial to trial? Judged on poses that had no part in setting them.

A trial's offset cannot be foreseen from other trials, so "held out" means something else here: a trial is cut into `BLOCKS`,
and every other block is predicted with the clock that those between ask for. Never is a clock judged on poses that set it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.estimate.noise import Filter, huber
from bns.diagnose.estimate.significance import Evidence, held_out_gain, sign_flip_p
from bns.diagnose.estimate.starts import fit_with
from bns.diagnose.estimate.trial_clocks import with_clocks_set
from bns.diagnose.predict.base import Predictor, Steps
from bns.physics.effects import all_effects
from bns.physics.model import Model

BLOCKS = 8
"""Of a trial. An earlier and a later half would differ where the clock drifts too."""
FEWEST_FRAMES = 3 * BLOCKS
"""Trials with fewer (the median trial) say too little of their own clocks."""
_FAR = 0.05
LEAST_SCATTER_S = 0.02
"""Clocks that differ by less (standard deviation) are left alike: motors that start a little late look the same."""


@dataclass(frozen=True)
class OwnClocks:
    """The fit with a clock for each trial, what that earns over one clock for all, and how far the clocks scatter (s)."""

    fit: Fit
    evidence: Evidence
    scatter_s: float


def steps_of(predictor: Predictor, following: Filter, model: Model) -> Steps:
    """What a model predicts; where trials have clocks of their own, each block of a trial with the clock of its neighbours."""
    return predictor.steps(model) if model.differing is None else _crossed(predictor, following, model)[0]


def own_clocks(problem: Problem, fit: Fit) -> OwnClocks | None:
    """A fitted model with a clock for each trial; None where they hardly differ, or already differ in the model."""
    effect = next(e for e in all_effects().values() if e.may_differ)
    if fit.model.differing is not None:
        return None
    if np.median(np.diff(problem.predictor.tracks.first)) < FEWEST_FRAMES:
        return None
    known = any(a.effect.name == effect.name for a in fit.model.effects)
    common = fit if known else fit_with(problem, fit, effect)
    apart = problem.fit(with_own_clocks(common.model, effect.name))
    return judged(problem, common, apart)


def judged(problem: Problem, common: Fit, apart: Fit) -> OwnClocks | None:
    """What a clock for each trial earns over one for all; None where they hardly differ."""
    predictor, following = problem.predictor, problem.following
    steps, halves = _crossed(predictor, following, apart.model)
    agreed = _agreement(*halves)
    scatter = float(np.sqrt(max(agreed.mean(), 0.0)))
    if scatter < LEAST_SCATTER_S or not _plausible(apart.model):
        return None
    losses = problem.per_trial(huber(following.white(predictor.tracks, steps)))
    gain, se = held_out_gain(common.held_out, losses)
    # were there nothing, the halves of a trial would differ from the others' as often in opposite ways as in the same
    return OwnClocks(apart, Evidence(gain, se, sign_flip_p(agreed[:, None], np.eye(1))), scatter)


def _plausible(model: Model) -> bool:
    """Do nearly all clocks lie where clocks can be? Else something that every trial has in another way was taken for one."""
    assert model.differing is not None
    low, high = model.differing.effect.parameters[0].plausible
    far = [not low < value < high for value in model.differing.own]
    return float(np.mean(far)) <= _FAR


def with_own_clocks(model: Model, name: str) -> Model:
    """The model in which every trial has its own value of that effect; none is known yet."""
    return replace(model, effects=tuple(replace(a, per_trial=True) if a.effect.name == name else a for a in model.effects))


def with_one_clock(model: Model) -> Model:
    """The model in which the mean of the trials' clocks serves all of them."""
    return replace(model, effects=tuple(replace(a, per_trial=False, own=()) for a in model.effects))


def every_other_block(tracks: Tracks) -> np.ndarray:
    """Frames in the second, fourth, ... of the `BLOCKS` of their trial, (frames,)."""
    lengths = np.diff(tracks.first)
    place: np.ndarray = np.arange(len(tracks.t_s)) - tracks.first[tracks.trial]
    return (place * BLOCKS // lengths[tracks.trial]) % 2 == 1


def _crossed(predictor: Predictor, following: Filter, model: Model) -> tuple[Steps, tuple[Array, Array]]:
    """Steps with the clocks of the other blocks, and the clocks (trials,) that odd and even blocks ask for."""
    even = every_other_block(predictor.tracks)
    found = [Problem(predictor, following, (even == which).astype(float)) for which in (False, True)]
    models = [with_clocks_set(problem, problem.fit(model, rounds=0).model) for problem in found]
    of_odd, of_even = (predictor.steps(m) for m in models)
    body = np.where(even[:, None], of_odd.body, of_even.body)
    drift = np.where(even[:, None], of_odd.drift_m, of_even.drift_m)
    clocks = [np.array(m.differing.own) for m in models if m.differing is not None]
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
