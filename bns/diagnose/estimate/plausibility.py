"""Whether fitted numbers can be believed: within their bounds, and within what is plausible."""

from __future__ import annotations

import numpy as np

from bns.diagnose.estimate.fit import Fit
from bns.physics.effect import Parameter


def at_bound(fit: Fit, name: str) -> bool:
    """Whether a number of an effect lies at a bound of the model: the data ask for more than it can be."""
    numbers = [
        (number.parameter, float(value))
        for number, value in zip(fit.free, fit.values, strict=True)
        if number.effect == name
    ]
    return any(_stopped(p, value) for p, value in numbers)


def implausible(fit: Fit, name: str, bounds: bool = True) -> str:
    """Why an effect with these numbers cannot be believed; "" if it can. ``bounds``: do numbers at one count?"""
    for index, number in enumerate(fit.free):
        p = number.parameter
        if number.effect != name:
            continue
        value, (low, high) = float(fit.values[index]), fit.interval(index)
        if bounds and _stopped(p, value):
            return f"{p.name} is at its bound, {value:g}{with_unit(p)}"
        if np.isfinite([low, high]).all() and (high < p.plausible[0] or low > p.plausible[1]):
            least, most = p.plausible
            return f"{p.name} = {value:g}{with_unit(p)} is outside of the plausible range, {least:g} to {most:g}"
    return ""


def with_unit(p: Parameter) -> str:
    """The unit behind a blank; nothing for a bare number."""
    return "" if p.unit == "1" else f" {p.unit}"


def _stopped(p: Parameter, value: float) -> bool:
    """Whether a fit ended at a bound that only the model has."""
    return value in {p.low, p.high} and value not in p.reached
