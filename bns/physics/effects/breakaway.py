"""A wheel at rest starts only above one command, and one that turns stops only below a lower one: friction at rest is higher.

A wheel that is told to reverse passes through rest, however suddenly, and must break away again. With both thresholds alike:
`dead-band`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.dead_band import EFFECT as ALIKE
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.standing import broken_away, summed_while_on

_SLOW, _FAST, _MANY = 0.01, 0.6, 48
"""Thresholds are looked for at so many values between these fractions of the highest speeds: no robot stands at most commands."""
_NEAR = np.linspace(0.92, 1.08, 17)
"""The second round looks so near the best of the first, which are nine hundredths apart."""


def apply(wheels: Wheels, threshold_m_s: float, stop_ratio: float) -> Wheels:
    """A wheel at rest starts at a command of ``threshold_m_s``, one that turns rests below ``stop_ratio``·``threshold_m_s``.

    It rests at the beginning and where its command changes sign, too.
    """
    stop = stop_ratio * threshold_m_s
    return wheels.turning(
        broken_away(wheels.left_m_s, wheels.step_s, threshold_m_s, stop),
        broken_away(wheels.right_m_s, wheels.step_s, threshold_m_s, stop),
    )


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The two thresholds with which wheels that stand and turn so come nearest to the speeds that the tracker saw.

    By least squares over all steps: what a pair of thresholds explains is a sum over the steps in which a wheel turns with it.
    """
    if wheels.conditions.seen is None:
        return ()
    told, saw = np.stack([wheels.left_m_s, wheels.right_m_s]), seen_speeds(wheels)
    gain = np.nan_to_num(told * (2.0 * saw - told)) * wheels.step_s
    told, gain = (values.reshape(-1, told.shape[-1]) for values in (told, gain))
    fastest = float(np.quantile(np.abs(told[told != 0]), 0.99)) if told.any() else 0.0
    if fastest == 0.0 or not gain.any():
        return ()
    thresholds = fastest * np.geomspace(_SLOW, _FAST, _MANY)
    start, stop = _best(told, gain, thresholds, thresholds)
    start, stop = _best(told, gain, start * _NEAR, stop * _NEAR)
    return ((start, stop / start),)


def _best(told: Array, gain: Array, starts: Array, stops: Array) -> tuple[float, float]:
    """The pair that explains most; a wheel stops at no higher command than it starts at."""
    start, stop = (grid.ravel() for grid in np.meshgrid(starts, stops))
    start, stop = start[stop <= start], stop[stop <= start]
    best = int(np.argmax(summed_while_on(told, gain, start, stop)))
    return float(start[best]), float(stop[best])


def seen_speeds(wheels: Wheels) -> Array:
    """Of both wheels, (2, batch, steps): between the steps before and after each; NaN where that was not seen."""
    seen, out = wheels.conditions.seen, np.full((2, *wheels.step_s.shape), np.nan)
    if seen is None or seen.shape[1] < 3:
        return out
    lasted = (wheels.trial_s[:, 2:] - wheels.trial_s[:, :-2])[..., None]
    moved = np.divide(seen[:, 2:] - seen[:, :-2], lasted, out=np.full_like(seen[:, 2:], np.nan), where=lasted > 0)
    heading = seen[:, 1:-1, 2]
    forward = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    turn = moved[..., 2] * wheels.wheelbase_m / 2.0
    out[0, :, 1:-1], out[1, :, 1:-1] = forward - turn, forward + turn
    return out


EFFECT = Effect(
    name="breakaway",
    stage="wheel",
    parameters=(
        replace(ALIKE.parameters[0], text="command at which a wheel at rest starts"),
        Parameter(
            "stop_ratio",
            "1",
            0.0,
            1.0,
            (0.0, 1.0),
            1.0,
            "command below which a turning wheel stops, divided by that at which one at rest starts",
            jagged=True,
            reached=(0.0, 1.0),
        ),
    ),
    equation="w = u from |u| >= t on until |u| < r·t or u changes sign, else 0, for each wheel",
    residuals="The same slow command is driven after a fast one and not after a stop.",
    lookalikes=("dead-band", "stribeck", "backlash"),
    sentence="a wheel at rest starts only at a higher command than the one at which a turning wheel stops",
    sized="a wheel at rest starts at {threshold_m_s}, and one that turns stops at {stop_ratio} of that",
    measurement="lift the robot, raise one wheel's command slowly until it turns, lower it until it stops, and note both",
    apply=apply,
    needs="track",
    extends="dead-band",
    starts_from=starts_from,
    revision=2,
)
