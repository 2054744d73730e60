"""At which ticks of a clock wheels took their commands, looked for in what they were seen to do; compiled."""

from __future__ import annotations

import numpy as np

from bns.engine.jit import exact
from bns.physics.signals import Array


@exact
def explained_by_ticks(told: Array, saw: Array, step_s: Array, periods_s: Array, lag_s: float, until_s: float) -> Array:
    """What speeds that are told at the ticks of a clock, and followed with a lag, explain of those seen, (periods,).

    By least squares: the sum of squares seen minus that of what is off, m^2/s. ``told``, ``saw`` (wheels, batch, steps), of which
    ``saw`` is NaN where nothing was seen; only the first ``until_s`` of each trial.
    """
    out = np.zeros(len(periods_s))
    wheels, batch, steps = told.shape
    fades = np.exp(-step_s / lag_s) if lag_s > 0.0 else np.zeros_like(step_s)
    for p in range(len(periods_s)):
        for wheel in range(wheels):
            for row in range(batch):
                now, tick, held, speed = 0.0, 0.0, 0.0, 0.0
                for k in range(steps):
                    h = step_s[row, k]
                    if h == 0.0:
                        continue
                    if now >= until_s:
                        break
                    now += h
                    if tick < now - 1e-9:
                        held = told[wheel, row, k]
                        tick += periods_s[p] * np.ceil((now - 1e-9 - tick) / periods_s[p])
                    speed = held + (speed - held) * fades[row, k]
                    seen = saw[wheel, row, k]
                    if not np.isnan(seen):
                        out[p] += h * speed * (2.0 * seen - speed)
    return out
