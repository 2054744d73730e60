"""Commands take effect on the ticks of a controller's clock, not when they are sent.

The clock is assumed to start with the trial, as in a program that is started for each trial. If it runs freely, each
command is late by a different fraction of the period: a `command-delay` of half a period on average, plus scatter.
"""

from __future__ import annotations

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.breakaway import seen_speeds
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.scans import sampled
from bns.physics.wheels.ticks import explained_by_ticks

_ROUND = (0.04, 0.05, 0.08, 0.1, 0.125, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0)
"""Makers choose round periods."""
_SHORTEST_S, _LONGEST_S = 0.02, 1.5
"""Other periods are looked for between these."""
_EARLY_S, _LATE_S = 3.0, 30.0
"""At first in so much of each trial, then in so much: ticks late in a trial fall into the right frame only very near the true
period, and the work grows with the square of the time that is looked at."""
_LAGS_S = (0.0, 0.06, 0.15, 0.3)
"""The wheels may follow with a lag."""
_BEST, _FINE = 3, 0.03
"""So many of these are then looked for in more of each trial, in steps by which its last tick moves by so much of a period."""


def apply(wheels: Wheels, period_s: float) -> Wheels:
    """Each wheel keeps the speed commanded at the last multiple of ``period_s``."""
    if period_s == 0.0:
        return wheels

    def late(values: Array) -> Array:
        return sampled(values, wheels.step_s, period_s)

    return wheels.following(late(wheels.left_m_s), late(wheels.right_m_s), late)


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """Round periods, and those at whose ticks, with a lag behind them, the wheels come nearest to the speeds that were seen.

    By least squares over the beginning of all trials, then over more of them: a period that is off by a quarter of its square
    over a time is off by a quarter of itself at the end of that time.
    """
    if wheels.conditions.seen is None:
        return tuple((period,) for period in _ROUND)
    told, saw = np.stack([wheels.left_m_s, wheels.right_m_s]), seen_speeds(wheels)
    late_s = float(np.clip(wheels.step_s.sum(axis=1).max(initial=0.0), _EARLY_S, _LATE_S))
    reach = 0.25 / _EARLY_S

    def explained(periods_s: Array, until_s: float) -> Array:
        return np.stack([explained_by_ticks(told, saw, wheels.step_s, periods_s, lag_s, until_s) for lag_s in _LAGS_S])

    early = 1.0 / np.arange(1.0 / _LONGEST_S, 1.0 / _SHORTEST_S, reach)
    first = explained(early, _EARLY_S).max(axis=0)
    found = []
    for at in np.argsort(-first)[:_BEST]:
        near = 1.0 / np.arange(1.0 / early[at] - reach, 1.0 / early[at] + reach, _FINE / late_s)
        found.append(float(near[explained(near, late_s).max(axis=0).argmax()]))
    return tuple((period,) for period in (*_ROUND, *found))


EFFECT = Effect(
    name="command-rate",
    stage="wheel",
    parameters=(
        Parameter(
            "period_s",
            "s",
            0.0,
            5.0,
            (0.0, 1.5),
            0.0,
            "time between two updates of the command",
            resolution=1e-4,
            jagged=True,
        ),
    ),
    equation="u'(t) = u(period·floor(t/period))",
    residuals="Each command takes effect at the next tick of a clock: late by between zero and one period.",
    lookalikes=("command-delay", "motor-lag"),
    sentence="the robot updates its command only at fixed intervals",
    sized="the robot updates its command only every {period_s}",
    measurement="log on the robot the time at which each command takes effect",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
