"""A driver switches a motor off for a while after a large change of its command: a protection against too high a current.

A motor draws most current just after its command has changed, in proportion to the change: the voltage that it induces still
belongs to its old speed.
"""

from __future__ import annotations

import math

import numpy as np

from bns.physics.effect import Effect, Parameter
from bns.physics.effects.breakaway import seen_speeds
from bns.physics.signals import Array, Wheels
from bns.physics.wheels.standing import tripped

_LONGEST_S = 1.0
"""What a wheel misses after a change is looked for so long at most, and until the next change."""
_PARTS = 4
"""A fit begins at the best limit of each of so many parts of the changes: beside other effects the best of all may be another."""


def apply(wheels: Wheels, step_m_s: float, off_s: float) -> Wheels:
    """A wheel's speed is 0 for ``off_s`` after its command changes by more than ``step_m_s``."""
    if not math.isfinite(step_m_s):
        return wheels
    return wheels.turning(*tripped(wheels.left_m_s, wheels.right_m_s, wheels.step_s, step_m_s, off_s, False))


def starts_from(wheels: Wheels) -> tuple[tuple[float, ...], ...]:
    """Limits and times with which wheels come nearest to where the tracker saw them; () without changes."""
    by, speed, missing = changes_and_missing(wheels)
    return starts_of(by.ravel(), speed.ravel(), missing.ravel())


def changes_and_missing(wheels: Wheels) -> tuple[Array, Array, Array]:
    """Of times at which a command changes: changes (m/s, in size), new speeds (m/s) and ways (m) that lack after; (2, changes).

    A way lacks until the next change, and within `_LONGEST_S`; left and right.
    """
    told, saw = np.stack([wheels.left_m_s, wheels.right_m_s]), seen_speeds(wheels)
    lacking = np.nan_to_num(told - saw) * wheels.step_s
    out = []
    for row, step_s in enumerate(wheels.step_s):
        lasting = step_s > 0
        by = np.abs(np.diff(told[:, row, lasting], axis=1, prepend=0.0))
        first = np.flatnonzero(by.any(axis=0))
        if not len(first):
            continue
        begun = np.cumsum(step_s[lasting]) - step_s[lasting]
        since = begun - begun[np.maximum.accumulate(np.where(by.any(axis=0), np.arange(by.shape[1]), first[0]))]
        near = np.where((since >= 0.0) & (since < _LONGEST_S), lacking[:, row, lasting], 0.0)
        missing = np.add.reduceat(near, first, axis=1)
        out.append(np.stack([by[:, first], told[:, row, lasting][:, first], missing]))
    found = np.concatenate(out, axis=2) if out else np.zeros((3, 2, 0))
    return found[0], found[1], found[2]


def starts_of(sizes: Array, speed: Array, missing: Array) -> tuple[tuple[float, ...], ...]:
    """By least squares, limits of ``sizes`` (n,) above which ``missing`` is ``speed`` times a time, and that time."""
    order = np.argsort(-sizes)
    sizes, speed, missing = sizes[order], speed[order], missing[order]
    way, square = np.cumsum(speed * missing), np.maximum(np.cumsum(speed**2), 1e-12)
    explained = np.where(way > 0.0, way**2 / square, 0.0)
    explained[:-1][sizes[:-1] - sizes[1:] < 1e-9] = 0.0  # no limit lies between equal sizes
    starts = []
    for part in np.array_split(np.arange(len(sizes)), _PARTS):
        best = part[np.argmax(explained[part])] if len(part) else 0
        if len(part) and explained[best] > 0.0:
            below = sizes[best + 1] if best + 1 < len(sizes) else 0.0
            starts.append((float(sizes[best] + below) / 2.0, float(way[best] / square[best])))
    return tuple(starts)


EFFECT = Effect(
    name="overload-trip",
    stage="wheel",
    parameters=(
        Parameter(
            *("step_m_s", "m/s", 1e-3, math.inf, (0.05, 1.0), math.inf),
            "change of a wheel's command above which its motor is switched off",
            size_power=1.0,
            resolution=1e-3,
            jagged=True,
        ),
        Parameter("off_s", "s", 0.0, 5.0, (0.0, 1.0), 0.0, "time for which it is off", resolution=1e-3),
    ),
    equation="u' = 0 for a time T after |du| > s, else u, for each wheel",
    residuals="After large changes of a wheel's command a distance of that wheel is missing that is proportional to its new "
    "speed; after small ones none is.",
    lookalikes=("supply-trip", "reversal-pause", "acceleration-limit"),
    sentence="a motor is switched off for a while after a large change of its command, as by a protection against overload",
    sized="a motor is switched off for {off_s} after a change of its command by more than {step_m_s}, as by a protection against "
    "overload",
    measurement="lift the robot, give one wheel steps of growing size, log its encoder; read the driver's fault flag",
    apply=apply,
    needs="track",
    starts_from=starts_from,
)
