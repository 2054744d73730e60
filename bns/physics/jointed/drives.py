"""What the servos of a body are told, step by step: stretches of a trial that are simulated each by itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bns.physics.jointed.mechanism import Mechanism
from bns.physics.jointed.plant import Array

RUN_UP_S = 2.0
"""Set points of at least this long before a stretch bring the joints to where they are when it begins."""


@dataclass(frozen=True)
class Drive:
    """A stretch of a trial.

    ``set_points`` (steps, joints), rad; ``frames``: after how many steps the robot is looked at, ascending. ``begin`` (3,): where
    it was seen at the first of them: x_m, y_m, heading_rad.
    """

    set_points: Array
    frames: NDArray[np.int64]
    begin: Array


def through_postures(
    mechanism: Mechanism, postures: Array, dt_s: float, begin: Array, looks: int = 2, before: int = 1
) -> Drive:
    """From posture (postures, joints) to posture: every servo at the same speed, all wait for the last.

    Looked at so many times, evenly spaced, from the posture that comes after the first ``before`` to the last.
    """
    q = mechanism.resolution_rad
    targets = np.round(postures / q) * q if q else postures
    parts, furthest = [targets[:1]], mechanism.joint_speed_rad_s * dt_s
    for start, target in pairwise(targets):
        way = target - start
        steps = int(np.ceil((np.abs(way).max() / mechanism.joint_speed_rad_s + mechanism.settle_s) / dt_s))
        reach = furthest * np.arange(1, steps + 1)[:, None]
        parts.append(start + np.clip(way, -reach, reach))
    ends = np.cumsum([len(part) for part in parts])
    return Drive(np.concatenate(parts), _looks(int(ends[before]), int(ends[-1]), looks), begin)


def at_times(
    t_s: Array,
    set_points: Array,
    seen_s: tuple[float, float],
    dt_s: float,
    begin: Array,
    looks: int = 2,
    run_up_s: float = RUN_UP_S,
    began: Array | None = None,
) -> Drive:
    """Set points (n, joints), each from its time t_s (n,) on, until the robot is seen for the last time.

    Those of the ``run_up_s`` before it is first seen bring the joints to where they are then. At the first of them the robot is
    at rest; where that is the first of all, in the posture ``began`` (joints,), if it is known.
    """
    from_s, to_s = seen_s
    start = max(from_s - run_up_s, float(t_s[0]))
    before = max(round((from_s - start) / dt_s), 1)
    steps = before + max(round((to_s - from_s) / dt_s), 1)
    at = np.searchsorted(t_s, start + np.arange(steps) * dt_s + 1e-9, side="right") - 1
    told = set_points[np.maximum(at, 0)]
    if began is not None and start == t_s[0]:
        told = np.concatenate([began[None], told[1:]])
    return Drive(told, _looks(before, steps, looks), begin)


def _looks(first: int, last: int, looks: int) -> NDArray[np.int64]:
    return np.linspace(first, last, looks).round().astype(np.int64)


def told_speed_rad_s(drives: Sequence[Drive], dt_s: float) -> float:
    """The fastest that set points move over half a second, but for the quickest hundredth.

    Set points may jump: over a shorter time, a jump is as fast as the time is short. The first of all is where a robot is, which
    nobody need have told it.
    """
    k = max(round(_OVER_S / dt_s), 1)
    told = [d.set_points[1:] for d in drives if len(d.set_points) > k + 1]
    ways = [np.abs(each[k:] - each[:-k]).max(axis=1) for each in told]
    return float(np.quantile(np.concatenate(ways), 0.99)) / (k * dt_s) if ways else 0.0


_OVER_S = 0.5
