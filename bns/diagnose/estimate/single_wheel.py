"""A gain of both wheels and a difference between them, which together are a change of one wheel, such as one that is worn."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import stdtrit

from bns.diagnose.estimate.fit import Fit
from bns.physics.figures import figures, figures_apart

_GAIN = ("speed-gain", "gain")
_RATIOS = {"wheel-mismatch": "turns", "wheel-diameters": "is"}


def single_wheel(fit: Fit) -> Iterator[str]:
    """A sentence where one wheel is, within its 95 % interval, as the model has it, and the other one certainly is not.

    Of the factors of both wheels, g·2/(1 + m) left and g·2·m/(1 + m) right; their standard errors to first order.
    """
    places = {(f.effect, f.parameter.name): i for i, f in enumerate(fit.free)}
    name = next((name for name in _RATIOS if (name, "ratio") in places), "")
    if _GAIN not in places or not name:
        return
    at = [places[_GAIN], places[name, "ratio"]]
    gain, ratio = (float(fit.values[i]) for i in at)
    factors = np.array([2.0, 2.0 * ratio]) * gain / (1.0 + ratio)
    slopes = np.array([[1.0 / gain, -1.0 / (1.0 + ratio)], [1.0 / gain, 1.0 / ratio - 1.0 / (1.0 + ratio)]]) * factors[:, None]
    variance = np.einsum("ij,jk,ik->i", slopes, fit.covariance[np.ix_(at, at)], slopes)
    half = float(stdtrit(max(len(fit.losses) - len(fit.free), 1), 0.975)) * np.sqrt(np.maximum(variance, 0.0))
    same = np.abs(factors - 1.0) <= half
    if same.sum() != 1:
        return
    other = int(np.flatnonzero(~same)[0])
    sides = ("left", "right")
    change, by = 100 * (factors[other] - 1.0), 100 * half[other]
    low, high = abs(change) - by, abs(change) + by
    needed = figures_apart(low, high)
    size, least, most = (figures(value, needed) for value in (abs(change), low, high))
    if name == "wheel-diameters":
        what = f"{size} % {'larger' if change > 0 else 'smaller'} than in the model"
    else:
        what = f"{size} % {'faster' if change > 0 else 'slower'} than commanded"
    yield (
        f"speed-gain and {name} together say that the {sides[1 - other]} wheel is as in the model, and that the {sides[other]} "
        f"one {_RATIOS[name]} {what} (95 %: {least} to {most} %): one cause, such as a worn wheel, may be behind both."
    )
