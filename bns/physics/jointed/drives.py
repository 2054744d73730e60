"""What the servos of a body are told, step by step: stretches of a trial that are simulated each by itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bns.physics.jointed.mechanism import Mechanism
from bns.physics.jointed.plant import Array


@dataclass(frozen=True)
class Drive:
    """A stretch of a trial.

    ``set_points`` (steps, joints), rad; ``frames``: after how many steps each frame is seen, ascending. ``begin`` (3,): where the
    robot was seen at the first of them: x_m, y_m, heading_rad.
    """

    set_points: Array
    frames: NDArray[np.int64]
    begin: Array


def through_postures(
    mechanism: Mechanism, postures: Array, dt_s: float, begin: Array, seen: int = 1, between_s: Sequence[float] = ()
) -> Drive:
    """From posture (postures, joints) to posture: every servo at the same speed, all wait for the last.

    Frames: in the posture number ``seen``, after it at the times ``between_s``, and in the last posture.
    """
    q = mechanism.resolution_rad
    targets = np.round(postures / q) * q if q else postures
    parts, furthest = [targets[:1]], mechanism.joint_speed_rad_s * dt_s
    for start, target in zip(targets[:-1], targets[1:], strict=True):
        way = target - start
        steps = int(np.ceil((np.abs(way).max() / mechanism.joint_speed_rad_s + mechanism.settle_s) / dt_s))
        reach = furthest * np.arange(1, steps + 1)[:, None]
        parts.append(start + np.clip(way, -reach, reach))
    ends = np.cumsum([len(part) for part in parts])
    first, last = int(ends[seen]), int(ends[-1])
    inner = np.clip(first + np.round(np.asarray(between_s, np.float64) / dt_s), first, last)
    return Drive(np.concatenate(parts), np.concatenate([[first], inner, [last]]).astype(np.int64), begin)


def told_speed_rad_s(drives: Sequence[Drive], dt_s: float) -> float:
    """The fastest that set points move, but for the quickest hundredth of the steps."""
    rates = [np.abs(np.diff(d.set_points, axis=0)).max(axis=1) for d in drives if len(d.set_points) > 1]
    return float(np.quantile(np.concatenate(rates), 0.99)) / dt_s if rates else 0.0
