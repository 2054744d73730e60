"""Whether fitted numbers can be believed: within their bounds, within what is plausible, and beside what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.pseudo_inverse import pseudo_inverse
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Parameter
from bns.physics.figures import with_unit
from bns.physics.model import Model

CHANCE = DEFAULTS.estimate.together_chance
_SETTLED = DEFAULTS.estimate.fit_settled


def at_bound(fit: Fit, name: str) -> bool:
    """Whether a number of an effect lies at a bound of the model: the data ask for more than it can be."""
    numbers = [
        (number.parameter, float(value))
        for number, value in zip(fit.free, fit.values, strict=True)
        if number.effect == name
    ]
    return any(_stopped(p, value) for p, value in numbers)


def does_no_more(fit: Fit, name: str) -> bool:
    """Whether an effect that extends another ended with a number at a bound that is neutral: it does no more than that other."""
    if not any(active.effect.name == name and active.effect.extends for active in fit.model.effects):
        return False
    pairs = zip(fit.free, fit.values, strict=True)
    return any(n.effect == name and _stopped(n.parameter, float(v)) and float(v) == n.parameter.neutral for n, v in pairs)


def implausible(fit: Fit, name: str, bounds: bool = True) -> str:
    """Why an effect with these numbers cannot be believed; "" if it can. ``bounds``: do numbers at one count?"""
    for index, number in enumerate(fit.free):
        p = number.parameter
        if number.effect != name:
            continue
        value, (low, high) = float(fit.values[index]), fit.interval(index)
        if bounds and _stopped(p, value):
            return f"{p.name} is at its bound, {value:g}{with_unit(p.unit)}"
        if not p.of_any_size and np.isfinite([low, high]).all() and (high < p.plausible[0] or low > p.plausible[1]):
            least, most = p.plausible
            return f"{p.name} = {value:g}{with_unit(p.unit)} is outside of the plausible range, {least:g} to {most:g}"
    return ""


def believable(fit: Fit, name: str) -> Model | None:
    """If a number of an effect is outside of its plausible range: the model with it at the end of that range, and bounded there.

    An interval by the curvature is as wide upwards as downwards; it may hold plausible numbers with which the loss is far higher.
    """
    own = {f.parameter.name: (f.parameter, float(v)) for f, v in zip(fit.free, fit.values, strict=True) if f.effect == name}
    ranged = {key: (p, value) for key, (p, value) in own.items() if not (p.of_any_size or _stopped(p, value))}
    outside = {key for key, (p, value) in ranged.items() if not p.plausible[0] <= value <= p.plausible[1]}
    if not outside:
        return None
    active = next(a for a in fit.model.effects if a.effect.name == name)
    numbers = active.effect.parameters
    bounded = tuple(replace(p, low=p.plausible[0], high=p.plausible[1]) if p.name in outside else p for p in numbers)
    values = (float(np.clip(active.by_name[p.name], p.low, p.high)) for p in bounded)
    return fit.model.with_active(replace(active.effect, parameters=bounded), tuple(values))


def undetermined(fit: Fit, name: str) -> str:
    """Why the numbers of an effect say nothing: every interval spans all that is allowed; "" if one does not.

    So it is where another effect of the model does the same: a gain beside a warm-up that outlasts every trial.
    """
    own = [i for i, number in enumerate(fit.free) if number.effect == name]
    if not own or not all(_spans(fit, i) for i in own):
        return ""
    return f"these data do not determine {' and '.join(fit.free[i].parameter.name for i in own)}"


def limiting(fit: Fit, name: str) -> bool:
    """Whether a number of an effect may be anything, so that the effect does the work of a shorter one.

    So it is, too, where it is as long as a trial or as the floor is wide, and would be longer, or as far away as a place may be:
    the log sets no end to it.
    """
    own = [i for i, number in enumerate(fit.free) if number.effect == name]
    return any(_spans(fit, i) or _endless(fit, i) for i in own)


def half_as_far(fit: Fit, name: str) -> Model | None:
    """The model with places of an effect that are as far away as they may be bounded at half of that; None where none is.

    Where even these are worse, the log does set an end to it: nearer than that, the effect is not what was driven.
    """
    ends = {n.parameter.name for i, n in enumerate(fit.free) if n.effect == name and n.parameter.floor_axis and _endless(fit, i)}
    if not ends:
        return None
    active = next(a for a in fit.model.effects if a.effect.name == name)
    numbers = active.effect.parameters
    bounded = tuple(replace(p, low=_halved(p, p.low), high=_halved(p, p.high)) if p.name in ends else p for p in numbers)
    values = (float(np.clip(active.by_name[p.name], p.low, p.high)) for p in bounded)
    return fit.model.with_active(replace(active.effect, parameters=bounded), tuple(values))


def _halved(p: Parameter, end: float) -> float:
    """Half as far from the middle of where it may be."""
    return (end + (p.low + p.high) / 2) / 2


def _endless(fit: Fit, i: int) -> bool:
    """Whether a number's only end is the log's: it is there, as nearly as a fit comes to where the loss is least."""
    p, value = fit.free[i].parameter, float(fit.values[i])
    if not (p.trial_share or p.floor_share):
        return False
    near = np.sqrt(2.0 * _SETTLED) * fit.se(i)  # there the loss is higher by what ends a fit
    return bool(value >= p.high - near or (p.floor_axis and value <= p.low + near))


def does_nothing(fit: Fit, name: str) -> bool:
    """Whether the numbers of an effect, all together, cannot be told from neutral; a limit that is found is not infinite."""
    return _each_may_be_neutral(fit, name) and not _apart_together(fit, name)


def known_together(fit: Fit, name: str) -> bool:
    """Whether no number of an effect by itself can be told from neutral, but all of them together can."""
    return _each_may_be_neutral(fit, name) and _apart_together(fit, name)


def _each_may_be_neutral(fit: Fit, name: str) -> bool:
    own = [(fit.interval(index), number.parameter.neutral) for index, number in enumerate(fit.free) if number.effect == name]
    return bool(own) and all(bool(low <= neutral <= high) for (low, high), neutral in own)


def _apart_together(fit: Fit, name: str) -> bool:
    """Wald's test of all numbers of an effect at once, at 5 %: F with as many degrees of freedom as there are trials to spare."""
    away = {i: fit.values[i] - f.parameter.neutral for i, f in enumerate(fit.free) if f.effect == name}
    own = [i for i, by in away.items() if np.isfinite(by) and fit.covariance[i, i] > 0]
    if not own:
        return False
    by = np.array([away[i] for i in own])
    statistic = float(by @ pseudo_inverse(fit.covariance[np.ix_(own, own)]) @ by) / len(own)
    return bool(fdtrc(len(own), max(len(fit.losses) - len(fit.free), 1), statistic) < CHANCE)


def _spans(fit: Fit, index: int) -> bool:
    """Whether the interval of a number reaches from one of its bounds to the other."""
    p, (low, high) = fit.free[index].parameter, fit.interval(index)
    return bool(np.isfinite([p.low, p.high]).all() and low <= p.low and high >= p.high)


def fitted_again(before: Model, fit: Fit, contradicted: bool = False) -> Iterator[str]:
    """The effects whose numbers were measured or published, with those that they have now; and those that are part of others now.

    ``contradicted``: of the numbers only those outside of the interval that they have now.
    """
    parts = {a.replaces.effect.name: a.effect.name for a in fit.model.effects if a.replaces}
    for active in (a for a in before.effects if a.effect.name in parts and a.basis not in {"measured", "published"}):
        yield f"{active.effect.name} is part of {parts[active.effect.name]}, which takes its place."
    intervals = {(f.effect, f.parameter.name): fit.interval(i) for i, f in enumerate(fit.free)}
    for active in (a for a in before.effects if a.basis in {"measured", "published"}):
        name = active.effect.name
        longer = parts.get(name, name)
        own = fit.model.values_of(longer)
        changed = {p.name: p for p in active.effect.parameters if own.get(p.name) != active.by_name[p.name]}
        if contradicted:
            ends = {key: intervals.get((longer, key), (-np.inf, np.inf)) for key in changed}
            changed = {key: p for key, p in changed.items() if not ends[key][0] <= active.by_name[key] <= ends[key][1]}
        was, now = (
            ", ".join(f"{key} = {values[key]:.5g}{with_unit(p.unit)}" for key, p in changed.items())
            for values in (active.by_name, own)
        )
        if changed:
            place = "" if longer == name else f" as part of {longer}, which takes its place"
            yield f"{name} was {active.basis} ({was}); its parameters were fitted again with the others{place}: {now}."


def _stopped(p: Parameter, value: float) -> bool:
    """Whether a fit ended at a bound that only the model has."""
    return value in {p.low, p.high} and value not in p.reached
