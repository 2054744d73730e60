"""A controller can set only certain speeds: whole encoder counts per cycle, or whole percents of its voltage."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.signals import Array, Wheels


def apply(wheels: Wheels, step_m_s: float, share: float) -> Wheels:
    """Each wheel's speed moved by the fraction ``share`` towards the nearest multiple of ``step_m_s``."""
    return wheels.turning(
        _moved(wheels.left_m_s, step_m_s, share),
        _moved(wheels.right_m_s, step_m_s, share),
    )


def _moved(speed: Array, step: float, share: float) -> Array:
    return speed + share * (rounded(speed, step) - speed)


def rounded(speed: Array, step: Array | float) -> Array:
    """The nearest multiple of a step."""
    out: Array = step * np.rint(speed / step)
    return out


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """The steps that explain most of what was tracked."""
    return best_steps(wheels, rounded)


def best_steps(wheels: Wheels, known: Callable[[Array, Array], Array]) -> tuple[tuple[float, ...], ...]:
    """Steps with which ``known`` (speed, step) speeds explain most of the ways that the wheels were tracked to roll.

    The loss has a valley for each number of steps below the fastest speed: all are looked at, as shares of that speed.
    """
    steady = _steady(wheels)
    some = np.unique(np.linspace(0, len(steady[0]) - 1, min(len(steady[0]), _MOST)).astype(int))
    speed, lasted, way = (values[some] for values in steady)
    fastest = np.abs(speed).max(initial=0.0)
    if len(speed) < _FEWEST or fastest == 0.0:
        return tuple((step, 1.0) for step in ROUND_M_S)
    told, steps = speed * lasted, fastest / _STEPS_BELOW
    off, square = way - told, told @ told
    moved = np.stack([(known(speed, step) - speed) * lasted for step in steps])
    moved -= np.outer(moved @ told / square, told)  # a wheel that is faster or slower by a share is fitted, too
    score = np.maximum(moved @ off, 0.0) ** 2 / ((moved**2).sum(axis=1) + _NOTHING_M2)
    padded = np.pad(score, 1)
    peaks = np.flatnonzero((score >= padded[:-2]) & (score >= padded[2:]))
    return tuple((float(steps[peak]), 1.0) for peak in peaks[np.argsort(-score[peaks])][:_TRIED])


def _steady(wheels: Wheels) -> tuple[Array, Array, Array]:
    """Of each wheel while commands do not change: speed as told, how long, and the way that it was tracked to roll, (n,) each."""
    if wheels.conditions.seen is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    told = np.stack([wheels.left_m_s, wheels.right_m_s])
    x_m, y_m, heading = np.moveaxis(wheels.conditions.seen, -1, 0)
    middle, turned = (heading[:, 1:] + heading[:, :-1]) / 2.0, np.diff(heading, axis=1)
    ahead = np.diff(x_m, axis=1) * np.cos(middle) + np.diff(y_m, axis=1) * np.sin(middle)
    rolled = np.stack([ahead + side * turned * wheels.wheelbase_m / 2.0 for side in (-1.0, 1.0)])
    same = (told[..., 1:] == told[..., :-1]).all(axis=0) & np.isfinite(rolled).all(axis=0)
    run = np.cumsum(~same, axis=1) + np.arange(len(same))[:, None] * (same.shape[1] + 1)
    lasted = (wheels.step_s[:, 1:] + wheels.step_s[:, :-1]) / 2.0
    which, runs = np.unique(run[same], return_inverse=True)
    totals = [np.bincount(runs, values[same], len(which)) for values in (lasted, *rolled, *(told[..., 1:] * lasted))]
    long = totals[0] > 0
    times, ways, speeds = totals[0][long], totals[1:3], totals[3:]
    way, speed = (np.concatenate([one[long] for one in two]) for two in (ways, speeds))
    return speed / np.tile(times, 2), np.tile(times, 2), way


_STEPS_BELOW = np.arange(1.2, 60.0, 0.02)
"""How many steps there may be below the fastest speed. Half of one more or less, and fast commands are rounded the other way."""
_FEWEST, _MOST, _TRIED, _NOTHING_M2 = 40, 600, 4, 1e-12
"""Fewest steady drives that say something, most that are looked at; steps that begin a fit; and a square of ways that is none."""
ROUND_M_S = (0.005, 0.008, 0.01, 0.016, 0.02, 0.025, 0.03, 0.04, 0.05, 0.08, 0.1, 0.2)
"""Makers choose round numbers."""
STEP = Parameter(
    "step_m_s",
    "m/s",
    1e-4,
    2.0,
    (1e-3, 0.5),
    0.02,
    "difference between neighbouring speeds",
    resolution=2e-5,
    jagged=True,
)

EFFECT = Effect(
    name="command-quantisation",
    stage="wheel",
    parameters=(
        STEP,
        Parameter("share", "1", 0.0, 2.0, (0.5, 1.5), 0.0, "fraction of the rounding that acts (1: all)"),
    ),
    equation="u' = u + a·(step·round(u/step) - u) for each wheel, a = 1",
    residuals="The error depends on the command alone: positive or negative, up to half a step, and equal for equal commands.",
    lookalikes=("dead-zone", "command-truncation"),
    sentence="the wheels can run only at speeds in coarse steps",
    sized="the wheels can run only at speeds in steps of {step_m_s}",
    measurement="lift the robot, raise one wheel's command slowly, log its encoder: its speed rises in steps",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
