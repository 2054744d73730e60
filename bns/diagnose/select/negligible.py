"""Accepted effects that are certain and matter to no prediction: a clock that is half a millisecond late, for example.

Many poses make an effect certain long before it is of use. A user reads a named effect as a fault of the model, and looks for it
in the robot; one that changes no error that can be seen is not worth that. It is, if without it the number of another effect
is a false one: a gain of 0.99 that is left out makes a dead zone of 5 mm/s one of 6.5.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bns.diagnose.estimate.cross_validation import held_out_steps
from bns.diagnose.estimate.fit import Fit, without_width
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.lacking import fit_without
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.significance import paired_elpd_diff
from bns.diagnose.predict.paired_errors import (
    HorizonErrors,
    PairedErrors,
    judged_windows,
    median_of_all,
    paired_errors,
    rms_of_all,
)
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.settings import DEFAULTS

LEAST_FALL = DEFAULTS.select.least_fall
NEARLY = DEFAULTS.select.tie_nearly
LUCK = DEFAULTS.select.least_fall_luck
MEDIAN_OF = DEFAULTS.select.least_fall_windows
LEAST_SHIFT = DEFAULTS.select.least_shift
SLIGHT = DEFAULTS.residuals.slight_excess
_ALL = "all"


@dataclass(frozen=True)
class Shift:
    """A number of an effect that is another one without a second effect."""

    effect: str
    parameter: str
    unit: str
    having: float
    lacking: float


def negligible(selection: SelectionResult) -> tuple[str, ...]:
    """Accepted effects without which no held-out error is higher by `least_fall`, at any horizon; the least first.

    Nor does a number of one that is not negligible itself change by `least_shift`, for certain. Each is judged beside all that
    are kept, so of two that can stand for one another one is kept. An effect alone is judged, too: white noise of a tracker, or
    cycles that hardly scatter, can make certain what no error shows.
    """
    return negligible_and_errors(selection)[0]


def negligible_and_errors(
    selection: SelectionResult,
) -> tuple[tuple[str, ...], PairedErrors | None, dict[str, tuple[Shift, ...]]]:
    """As `negligible`; the held-out errors without each of the others, and with all of these (None where none is left); and which
    of the others no error shows, each with the numbers that shift without it.
    """
    dropped: tuple[str, ...] = ()
    while len(kept := tuple(name for name in selection.accepted if name not in dropped)):
        fits = _without_each(selection, dropped, kept)
        errors = _errors_of(selection.problem, fits)
        falls = {name: _largest_fall(errors, name, _ALL) for name in kept}
        firm = {name for name in kept if falls[name] >= LEAST_FALL}
        moved = {name: shifted(fits[_ALL], fits[name], firm) for name in kept if name not in firm}
        tiny = [name for name, numbers in moved.items() if not numbers]
        if not tiny:
            return dropped, errors, {name: _shifts(fits[_ALL], fits[name], numbers) for name, numbers in moved.items()}
        dropped = (*dropped, min(tiny, key=lambda name: falls[name]))
    return dropped, None, {}


def _shifts(having: Fit, lacking: Fit, numbers: Sequence[FreeParameter]) -> tuple[Shift, ...]:
    return tuple(
        Shift(n.effect, n.parameter.name, n.parameter.unit, n.of(having.model), n.of(lacking.model)) for n in numbers
    )


def below_noise(errors: PairedErrors | None, names: Sequence[str]) -> tuple[str, ...]:
    """Those without which the held-out error is higher by less than tracking noise (`slight_excess`), at every horizon.

    ``errors``: of `negligible_and_errors`. Root sums of squares are compared, as of all that is left. None where the tracks do
    not tell their noise.
    """
    at_horizons = [at for at in errors.horizons.values() if at.windows] if errors is not None else []
    judged = {model.name for at in at_horizons for model in at.models}
    return tuple(name for name in names if name in judged and all(_excess(at, name) < SLIGHT for at in at_horizons))


def _excess(at: HorizonErrors, name: str) -> float:
    """Of the error without something over that with all, as root difference of squares; in tracking noises. NaN if unknown."""
    return math.sqrt(max(at.rms_of(name) ** 2 - at.rms_of(_ALL) ** 2, 0.0)) / at.noise_floor_m


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


def negligibly_worse(problem: Problem, tried: Fit, fit: Fit, without: Fit) -> bool:
    """Does ``tried`` nearly all that ``fit`` does (`tie_nearly`), and shows no held-out error what it lacks (`least_fall`)?

    ``without``: neither has been added. A lag of 6 ms and a delay of 6 ms differ within one frame of a camera. What a robot's
    controller does in that time is neither, and the one that happens to be nearer is not therefore the true one.
    """
    worth, lost = (paired_elpd_diff(other.held_out, fit.held_out)[0] for other in (without, tried))
    if len(tried.free) > len(fit.free) or lost > NEARLY * worth:
        return False
    return _most_that_falls(problem, tried, fit) < LEAST_FALL


def _most_that_falls(problem: Problem, tried: Fit, fit: Fit) -> float:
    """As `_largest_fall` from one fit to another, over the windows of trials that count: errors of a bad trial hide all others.

    The median has a say however few the windows are. Luck in it can only keep a rival out.
    """
    predictor, falls = problem.predictor, [0.0]
    steps = [held_out_steps(predictor, problem.pose_filter, one.model) for one in (tried, fit)]
    for horizon in predictor.horizons:
        errors = [judged_windows(predictor, one, horizon) for one in steps]
        if predictor.counted is not None:
            counting = np.unique(predictor.tracks.trial[predictor.counted > 0])
            errors = [one.only(np.isin(one.trial, counting)) for one in errors]
        windows = len(errors[0].start)
        measures = [(rms_of_all(e.position_m), rms_of_all(e.heading_rad), median_of_all(e.position_m)) for e in errors]
        falls += [_falls_by(before, after, windows) for before, after in zip(*measures, strict=True) if before > 0]
    return max(falls)


def shifted(having: Fit, lacking: Fit, effects: Collection[str]) -> tuple[FreeParameter, ...]:
    """Numbers of these effects that differ for certain from model to model: each lies outside of the other one's interval.

    By `least_shift` of what the effect does: of the largest distance of its numbers with that unit from those of no effect.
    """
    others = {number: index for index, number in enumerate(lacking.free)}
    sizes: dict[tuple[str, str], float] = {}
    for number, value in zip(having.free, having.values, strict=True):
        key = number.effect, number.parameter.unit
        sizes[key] = max(sizes.get(key, 0.0), _size(number, float(value)))
    found = []
    for index, number in enumerate(having.free):
        at = others.get(number)
        if at is None or number.effect not in effects:
            continue
        value, other = float(having.values[index]), float(lacking.values[at])
        apart = not (_within(other, having.interval(index)) or _within(value, lacking.interval(at)))
        if apart and abs(other - value) >= LEAST_SHIFT * sizes[number.effect, number.parameter.unit]:
            found.append(number)
    return tuple(found)


def _size(number: FreeParameter, value: float) -> float:
    """How far a number is from where its effect does nothing; of a limit, which then is infinite, how large it is."""
    neutral = number.parameter.neutral
    return abs(value - neutral) if np.isfinite(neutral) else abs(value)


def _within(value: float, interval: tuple[float, float]) -> bool:
    """So it is said to be where the interval has no width, and says nothing."""
    low, high = interval
    return without_width(low, high) or low <= value <= high


def _without_each(selection: SelectionResult, dropped: Sequence[str], kept: Sequence[str]) -> dict[str, Fit]:
    """The fit with all that are kept, and those that lack one of them, by its name."""
    problem, model = selection.problem, selection.fit.model
    for name in dropped:
        model = model.without(name)
    whole = problem.fit(model, nearby=selection.fit.jacobian_by_parameter)
    return {_ALL: whole, **{name: fit_without(problem, whole, name) for name in kept}}


def _errors_of(problem: Problem, fits: Mapping[str, Fit]) -> PairedErrors:
    steps = [(name, held_out_steps(problem.predictor, problem.pose_filter, fit.model)) for name, fit in fits.items()]
    return paired_errors(problem.predictor, steps)


def seen_in_heading(errors: PairedErrors | None, names: Collection[str]) -> dict[str, tuple[str, float, float]]:
    """Of effects that are not negligible, those that lower no error of position by `least_fall`: at which horizon they lower that
    of the heading most, and that error without and with them (rad). ``errors``: of `negligible_and_errors`."""
    found = {}
    for name in names if errors is not None else ():
        assert errors is not None
        if _largest_fall(errors, name, _ALL, heading=False) < LEAST_FALL <= _largest_fall(errors, name, _ALL):
            without = {h: one.heading_rad for h, one in errors.of(name).items() if one.heading_rad > 0.0}
            at = {h: (rad, errors.of(_ALL)[h].heading_rad) for h, rad in without.items()}
            most = max(at, key=lambda h: _falls_by(*at[h], errors.horizons[h].windows))
            found[name] = most, *at[most]
    return found


def _largest_fall(errors: PairedErrors, before: str, after: str, heading: bool = True) -> float:
    """By which fraction the error falls from one model to another beyond luck, at the horizon and in the measure of most.

    ``heading``: is that of the heading one of these.
    """
    models = errors.of(before), errors.of(after)
    falls = []
    for horizon, at in errors.horizons.items():
        one, other = (named[horizon] for named in models)
        pairs = [(one.rms_m, other.rms_m)] + ([(one.heading_rad, other.heading_rad)] if heading else [])
        pairs += [(one.median_m, other.median_m)] if at.windows >= MEDIAN_OF else []
        falls += [_falls_by(a, b, at.windows) for a, b in pairs if a > 0]
    return max(falls, default=0.0)


def _falls_by(before: float, after: float, windows: int) -> float:
    return float(1.0 - after / before - LUCK / np.sqrt(windows))
