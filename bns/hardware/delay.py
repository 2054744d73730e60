"""How much older than its time stamp a tracker's pose is, from a motion that robot and tracker both report.

The robot turns on the spot to and fro, in steps of unequal lengths. Its encoders tell its heading up to a scale (wheels slip)
and an offset, its tracker tells it up to a delay. A snake bends instead: its joints tell how far its markers are apart.
Correlated over all delays (Knapp and Carter, The generalized correlation method for estimation of time delay, IEEE Transactions
on Acoustics, Speech, and Signal Processing 24(4), 1976), the best of them is the tracker's: the one at which a straight line
through the robot's own account leaves the least of the seen one. A reading of the robot's belongs to the middle between question
and answer; a link slower one way than the other makes that wrong by half the difference.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from bns.errors import HardwareError
from bns.hardware.clock import Clock
from bns.hardware.safety import Watch
from bns.hardware.tracking.eye import Eye

_SPEED_M_S = 0.08
"""Fast enough that a kernel which smooths small changes (a Wii remote's) holds a pose back little."""
_STEPS_S = (0.5, 0.35, 0.65, 0.3, 0.6, 0.45)
"""Of turning one way, then the other; not the same again and again, or a delay of a whole period would do as well."""
_LOOK_S = 0.01
_LONGEST_S = 0.6
_GRID_S = 0.001
_FEWEST = 30
_WORST_CORRELATION = 0.98


class Motion(NamedTuple):
    """A motion by the robot's own account and by its tracker, each with its times (s): (n,).

    Two wheels: way of the right one less that of the left one, m; heading, rad. A snake: distance of its markers, m, both times.
    """

    robot_s: np.ndarray
    robot: np.ndarray
    seen_s: np.ndarray
    seen: np.ndarray


class Delay(NamedTuple):
    """The delay and its standard error, s; the correlation there; how many readings and sights it rests on."""

    delay_s: float
    error_s: float
    correlation: float
    readings: int
    sights: int


class TurningWheels(Protocol):
    """What is asked of a robot's driver."""

    def set_speed_m_s(self, left: float, right: float) -> tuple[float, float]:
        """Set speeds; what was really sent."""

    def encoders_m(self) -> tuple[float, float]:
        """Ways of the wheels, m."""


def turned(wheels: TurningWheels, eye: Eye, watch: Watch, clock: Clock, seconds: float) -> Motion:
    """Turn to and fro for so long; whoever calls this stops the robot."""
    robot: list[tuple[float, float]] = []
    seen: list[tuple[float, float]] = []
    watch.begin()
    began_s, next_s, steps = clock.now_s(), clock.now_s(), signed_steps()
    while clock.now_s() - began_s < seconds:
        if clock.now_s() >= next_s:
            side, lasts_s = next(steps)
            speed_m_s = side * _SPEED_M_S
            wheels.set_speed_m_s(-speed_m_s, speed_m_s)
            next_s += lasts_s
        asked_s = clock.now_s()
        left_m, right_m = wheels.encoders_m()
        robot.append(((asked_s + clock.now_s()) / 2.0, right_m - left_m))
        sight = eye.look()
        watch.check(sight, eye.picture_s)
        if sight is not None and (not seen or sight.t_s > seen[-1][0]):
            seen.append((sight.t_s, float(sight.pose[2])))
        clock.sleep(_LOOK_S)
    return Motion(*np.array(robot).T, *np.array(seen).reshape(-1, 2).T)


def signed_steps() -> Iterator[tuple[float, float]]:
    """Which way (1 or -1), and for how long, s; as much one way as the other."""
    side = 1.0
    while True:
        for lasts_s in _STEPS_S:
            yield side, lasts_s
            side = -side
        side = -side  # the next round the other way, so that it comes back


def delay_between(motion: Motion, known_s: float = 0.0) -> Delay:
    """The delay of the tracker; `known_s` is what the sights' times have been corrected by already. HardwareError without one."""
    count = len(motion.seen_s)
    if count < _FEWEST:
        raise HardwareError(f"the robot was seen {count} times while it moved to and fro; {_FEWEST} are needed. Try: bns track")
    tried_s = np.arange(-_LONGEST_S / 4, _LONGEST_S + _GRID_S, _GRID_S)
    inside = (motion.seen_s > motion.robot_s[0] + tried_s[-1]) & (motion.seen_s < motion.robot_s[-1] + tried_s[0])
    seen_s, seen = motion.seen_s[inside], motion.seen[inside]
    squares = np.array([_left_over(motion, seen_s - late_s, seen) for late_s in tried_s])
    best = int(np.argmin(squares))
    total = float(np.sum((seen - seen.mean()) ** 2))
    correlation = float(np.sqrt(max(0.0, 1.0 - squares[best] / total)))
    if correlation < _WORST_CORRELATION or best in {0, len(tried_s) - 1}:
        raise HardwareError(
            f"what was seen does not follow the robot's own motion (correlation {correlation:.2f} at the best delay, "
            f"{tried_s[best]:.2f} s): is another thing tracked, do wheels slip, is the delay above {_LONGEST_S:g} s?"
        )
    a, b, _ = np.polyfit(tried_s[best - 1 : best + 2] - tried_s[best], squares[best - 1 : best + 2], 2)
    found_s = float(tried_s[best] - b / (2.0 * a))
    variance = squares[best] / max(len(seen_s) - 4, 1)  # a line of two numbers, a drift, the delay
    return Delay(found_s + known_s, float(np.sqrt(variance / a)), correlation, len(motion.robot_s), len(seen_s))


def _left_over(motion: Motion, at_s: np.ndarray, seen: np.ndarray) -> float:
    """Squares that the robot's own account at these times, a scale, an offset and a steady drift leave of the seen one, rad²."""
    design = np.column_stack([np.interp(at_s, motion.robot_s, motion.robot), np.ones(len(at_s)), at_s - at_s[0]])
    solved = np.linalg.lstsq(design, seen, rcond=None)[0]
    return float(np.sum((seen - design @ solved) ** 2))
