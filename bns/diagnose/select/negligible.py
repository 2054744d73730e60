"""Accepted effects that are certain and matter to no prediction: a clock that is half a millisecond late, for example.

Many poses make an effect certain long before it is of use. A user reads a named effect as a fault of the model, and looks for it
in the robot; one that changes no error that can be seen is not worth that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.fit import Fit, Problem
from bns.diagnose.predict.paired_errors import PairedErrors, paired_errors
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS

LEAST_FALL = DEFAULTS.select.least_fall
LUCK = DEFAULTS.select.least_fall_luck
MEDIAN_OF = DEFAULTS.select.least_fall_windows
_ALL = "all"


def negligible(selection: SelectionResult, fewest: int = 1) -> tuple[str, ...]:
    """Accepted effects without which no held-out error is higher by `least_fall`, at any horizon; the least first.

    Each is judged beside all that are kept, so of two that can stand for one another one is kept. The last ``fewest`` are not
    judged: an effect alone has been, by the errors of the model as given.
    """
    dropped: tuple[str, ...] = ()
    while len(kept := tuple(name for name in selection.accepted if name not in dropped)) > fewest:
        errors = _without_each(selection, dropped, kept)
        falls = {name: _largest_fall(errors, name, _ALL) for name in kept}
        least = min(falls, key=lambda name: falls[name])
        if falls[least] >= LEAST_FALL:
            break
        dropped = (*dropped, least)
    return dropped


def fall_matters(errors: PairedErrors, before: str, after: str) -> bool:
    """Is the error of one model certainly lower than that of another at one horizon, by `least_fall`?"""
    for at in errors.horizons.values():
        rms_m = next(one.rms_m for one in at.models if one.name == before)
        change = at.change_between(before, after)
        if change.fell and -change.change_m >= LEAST_FALL * rms_m:
            return True
    return False


def certainly_better(lacking: tuple[Problem, Fit], having: tuple[Problem, Fit]) -> bool:
    """As `fall_matters`, on held-out trials from one fit to another."""
    predictor = having[0].predictor
    steps = [
        (name, held_out_steps(predictor, problem.pose_filter, fit.model))
        for name, (problem, fit) in (("lacking", lacking), (_ALL, having))
    ]
    return fall_matters(paired_errors(predictor, steps), "lacking", _ALL)


def _without_each(selection: SelectionResult, dropped: Sequence[str], kept: Sequence[str]) -> PairedErrors:
    problem, model = selection.problem, selection.fit.model
    for name in dropped:
        model = model.without(name)
    models = [(_ALL, model)] + [(name, model.without(name)) for name in kept]
    fits = [(name, problem.fit(one, nearby=selection.fit.jacobian_by_parameter).model) for name, one in models]
    predictor = problem.predictor
    return paired_errors(predictor, [(name, held_out_steps(predictor, problem.pose_filter, m)) for name, m in fits])


def _largest_fall(errors: PairedErrors, before: str, after: str) -> float:
    """By which fraction the error falls from one model to another beyond luck, at the horizon and in the measure of most."""
    models = errors.of(before), errors.of(after)
    falls = []
    for horizon, at in errors.horizons.items():
        one, other = (named[horizon] for named in models)
        pairs = [(one.rms_m, other.rms_m), (one.heading_rad, other.heading_rad)]
        pairs += [(one.median_m, other.median_m)] if at.windows >= MEDIAN_OF else []
        falls += [1 - b / a - LUCK / np.sqrt(at.windows) for a, b in pairs if a > 0]
    return max(falls, default=0.0)
