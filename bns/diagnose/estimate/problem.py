"""The fitting problem of a model on tracks: the filter that follows them has the noise estimated under that model."""

from __future__ import annotations

from bns.diagnose.data.tracks import Array
from bns.diagnose.estimate.fit import Problem
from bns.diagnose.estimate.noise import estimate_noise, filter_for
from bns.diagnose.predict.base import Predictor
from bns.physics.model import Model


def problem_for(predictor: Predictor, model: Model, start: Array | None = None) -> Problem:
    """The problem of fitting models like this one: its noise is estimated under it."""
    predictor.anchor(model)
    steps = predictor.steps(model)
    return Problem(predictor, filter_for(predictor, steps, estimate_noise(predictor, steps, start)), predictor.counted)
