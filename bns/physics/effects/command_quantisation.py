"""A controller can set only certain speeds: whole encoder counts per cycle, or whole percents of its voltage."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

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
    speed, lasted, first, way = _some(*_drives(wheels))
    fastest = np.abs(speed).max(initial=0.0)
    if len(first) < _FEWEST or fastest == 0.0:
        return tuple((step, 1.0) for step in ROUND_M_S)
    told, steps = np.add.reduceat(speed * lasted, first), fastest / _STEPS_BELOW
    off, square = way - told, told @ told
    moved = np.stack([np.add.reduceat((known(speed, step) - speed) * lasted, first) for step in steps])
    moved -= np.outer(moved @ told / square, told)  # a wheel that is faster or slower by a share is fitted, too
    score = np.maximum(moved @ off, 0.0) ** 2 / ((moved**2).sum(axis=1) + _NOTHING_M2)
    padded = np.pad(score, 1)
    peaks = np.flatnonzero((score >= padded[:-2]) & (score >= padded[2:]))
    return tuple((float(steps[peak]), 1.0) for peak in peaks[np.argsort(-score[peaks])][:_TRIED])


def _some(speed: Array, lasted: Array, first: NDArray[np.int64], way: Array) -> tuple[Array, Array, NDArray[np.int64], Array]:
    """At most `_MOST` of the drives that `_drives` gives, from the first to the last."""
    some = np.unique(np.linspace(0, len(first) - 1, min(len(first), _MOST)).astype(int))
    counts = np.diff(np.append(first, len(speed)))
    inside = np.repeat(np.isin(np.arange(len(first)), some), counts)
    return speed[inside], lasted[inside], np.cumsum(counts[some]) - counts[some], way[some]


def _drives(wheels: Wheels) -> tuple[Array, Array, NDArray[np.int64], Array]:
    """Of each wheel: speeds as told and how long, (n,); the first of each drive among these, and the way that it was tracked to
    roll in it, (drives,).

    A drive is one command; where commands change all the time, what comes in `_PIECE_S`: a pose says little of a shorter way.
    """
    if wheels.conditions.seen is None:
        return np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros(0)
    told = np.stack([wheels.left_m_s, wheels.right_m_s])
    x_m, y_m, heading = np.moveaxis(wheels.conditions.seen, -1, 0)
    middle, turned = (heading[:, 1:] + heading[:, :-1]) / 2.0, np.diff(heading, axis=1)
    ahead = np.diff(x_m, axis=1) * np.cos(middle) + np.diff(y_m, axis=1) * np.sin(middle)
    rolled = np.stack([ahead + side * turned * wheels.wheelbase_m / 2.0 for side in (-1.0, 1.0)])
    lasted = (wheels.step_s[:, 1:] + wheels.step_s[:, :-1]) / 2.0
    there = np.isfinite(rolled).all(axis=0) & (lasted > 0.0)
    same = (told[..., 1:] == told[..., :-1]).all(axis=0) & there
    own = np.arange(len(same))[:, None] * (same.shape[1] + 1)  # no drive goes on in the next trial
    if lasted[same].sum() >= _STEADY * lasted[there].sum():
        there, drive = same, np.cumsum(~same, axis=1) + own
    else:
        drive = (np.cumsum(~there, axis=1) + own) * _FAR + (np.cumsum(lasted, axis=1) - lasted) // _PIECE_S
    speed = (told[..., 1:] + told[..., :-1]) / 2.0
    _, first, which = np.unique(drive[there], return_index=True, return_inverse=True)
    ways = np.concatenate([np.bincount(which, one[there]) for one in rolled])
    if there is same:  # all of a drive at one speed
        times: Array = np.tile(np.bincount(which, lasted[there]).astype(np.float64), 2)
        driven = np.concatenate([np.bincount(which, one[there] * lasted[there]) for one in speed])
        return driven / times, times, np.arange(len(times), dtype=np.int64), ways
    first = np.concatenate([first, first + len(which)])
    return np.concatenate([one[there] for one in speed]), np.tile(lasted[there], 2), first.astype(np.int64), ways


_STEPS_BELOW = np.arange(1.2, 60.0, 0.02)
"""How many steps there may be below the fastest speed. Half of one more or less, and fast commands are rounded the other way."""
_FEWEST, _MOST, _TRIED, _NOTHING_M2 = 40, 600, 4, 1e-12
"""Fewest drives that say something, most that are looked at; steps that begin a fit; and a square of ways that is none."""
_STEADY, _PIECE_S, _FAR = 0.5, 0.5, 1e6
"""Share of the time for which commands stay as they are, from which on each is a drive, else this long; more than its pieces."""
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
