"""The fitting problem of a model on tracks: the filter that follows them has the noise estimated under that model."""

from __future__ import annotations

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.clocks.trial_clock_test import steps_of
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import estimate_noise, filter_for
from bns.diagnose.estimate.stretch_noise import estimate_stretch_noise, stretch_filter
from bns.diagnose.predict.base import Predictor, Steps
from bns.diagnose.settings import DEFAULTS
from bns.physics.model import Model

_ROUNDS = DEFAULTS.estimate.set_rounds


def problem_for(predictor: Predictor, model: Model, start: Array | None = None) -> Problem:
    """The problem of fitting models like this one: its noise is estimated under it."""
    predictor.anchor(model)
    steps = predictor.steps(model)
    noise = (estimate_noise if predictor.luck is None else estimate_stretch_noise)(predictor, steps, start)
    return problem_with_noise(predictor, steps, noise)


def settled_problem(predictor: Predictor, model: Model, start: Array | None = None) -> tuple[Problem, Fit]:
    """Noise and numbers that belong together; again while what the predictor says near these numbers becomes more exact."""
    problem = problem_for(predictor, model, start)
    fit = problem.fit(model)
    for _ in range(_ROUNDS):
        if not predictor.anchor(fit.model):
            break
        problem = problem_for(predictor, fit.model, problem.pose_filter.noise)
        fit = problem.fit(fit.model)
    return problem, fit


def given_steps(predictor: Predictor, model: Model) -> Steps:
    """What a model predicts as it is. Only clocks of its trials' own need a filter, whose noise takes long to estimate."""
    if model.per_trial_effect is not None:
        return steps_of(predictor, problem_for(predictor, model).pose_filter, model)
    predictor.anchor(model)
    return predictor.steps(model)


def problem_with_noise(predictor: Predictor, steps: Steps, noise: Array) -> Problem:
    """The same with a noise that is known; ``steps``: what a model predicts."""
    if predictor.luck is None:
        return Problem(predictor, filter_for(predictor, steps, noise), predictor.counted)
    return Problem(predictor, stretch_filter(predictor, steps, noise), predictor.counted)
