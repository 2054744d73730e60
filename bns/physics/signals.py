"""What passes from one stage of the simulation to the next: whole trials at once, never one instant.

wheel: commanded speeds become the speeds of the wheels' surfaces · body: these become velocities of the robot
· world: the floor and what hangs on the robot add to them · clock: when the tracker looks · measure: what it then sees.

Arrays are (batch, steps). A value is the mean over its step, so that distances stay exact where a speed
changes inside a step. Steps of length 0 pad short trials and must do nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bns.errors import ModelError, unknown_name

Array = NDArray[np.float64]

CREEP_M_S = 1e-3
"""Wheels slower than this count as partly moving: a jump at zero would be hard to fit. When a robot
begins to move, and with it what acts on it only while moving, is thus known to one step."""


class Logged(Mapping[str, Array]):
    """Every further number that was logged, by its column's name: (batch, steps), straight lines between what was logged.

    A column is worked out when it is first asked for. ModelError for a name that was not logged, with those that were.
    """

    def __init__(self, names: Iterable[str] = (), of: Callable[[str], Array] | None = None) -> None:
        self._names, self._of, self._known = tuple(names), of, dict[str, Array]()

    def __getitem__(self, name: str) -> Array:
        if name not in self._names or self._of is None:
            if not self._names:
                raise ModelError(
                    f"The column of the log {name!r} is asked for, and there is none: the measurements have no further "
                    "columns, or the model is driven without a log."
                )
            raise ModelError(unknown_name("column of the log", name, self._names))
        if name not in self._known:
            self._known[name] = self._of(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


@dataclass(frozen=True)
class Conditions:
    """What else was logged at each step, (batch, steps); None where it was not.

    session_s: time since the session began, s. battery_drop_v: voltage below the first one that was logged, V. seen: tracked x_m,
    y_m (m), heading_rad (rad, unwrapped) between frames, (batch, steps, 3). logged: any further column by its name, as it was
    logged.
    """

    session_s: Array | None = None
    battery_drop_v: Array | None = None
    seen: Array | None = None
    """Tracked x_m, y_m, heading_rad (unwrapped) between frames, (batch, steps, 3); NaN before the first and after the last."""
    logged: Logged = field(default_factory=Logged)


NO_CONDITIONS = Conditions()


@dataclass(frozen=True)
class Wheels:
    """Stage ``wheel``: mean speeds of the two wheels' surfaces, at rest before the first step.

    An effect returns them changed, with `turning` (or `following`, if it makes the wheels late). Arrays are (batch, steps).

    step_s: how long each step lasts, s; 0 pads a short trial. left_m_s, right_m_s: mean speed of a wheel's surface over the step,
    m/s; at first those that were commanded. wheelbase_m: distance of the wheels, m. conditions: what else was logged
    (`Conditions`). followed: how far, 0 to 1, what acts only while the robot moves has come; None where wheels are not late.
    To look at, too: moving (0 to 1), session_s, trial_s (s), places (n, 2) (m), logged.
    """

    step_s: Array
    left_m_s: Array
    right_m_s: Array
    wheelbase_m: float
    conditions: Conditions = NO_CONDITIONS
    followed: Array | None = None
    """From 0 to 1: where wheels follow their commands late, what acts only while the robot moves comes and goes as late, within a
    step as well. None: they do not."""

    @property
    def moving(self) -> Array:
        """From 0 (wheels at rest) to 1, the mean over each step."""
        fastest = np.maximum(np.abs(self.left_m_s), np.abs(self.right_m_s))
        out: Array = np.minimum(fastest / CREEP_M_S, 1.0 if self.followed is None else self.followed)
        return out

    @property
    def session_s(self) -> Array:
        """Time since the session began; since the trial began where nobody said."""
        if self.conditions.session_s is not None:
            return self.conditions.session_s
        return self.trial_s

    @property
    def logged(self) -> Logged:
        """Further columns of the log by name, (batch, steps) each: ``wheels.logged["current_a"]``."""
        return self.conditions.logged

    @property
    def trial_s(self) -> Array:
        """Time since the trial began, in the middle of each step."""
        ends: Array = np.cumsum(self.step_s, axis=1)
        return ends - self.step_s / 2.0

    @property
    def places(self) -> Array:
        """All tracked places, (n, 2); none where nothing was tracked."""
        if self.conditions.seen is None:
            return np.zeros((0, 2))
        seen = self.conditions.seen[..., :2]
        out: Array = seen[np.isfinite(seen).all(axis=-1)]
        return out

    def turning(self, left_m_s: Array, right_m_s: Array) -> Wheels:
        """The same with other speeds."""
        return replace(self, left_m_s=left_m_s, right_m_s=right_m_s)

    def following(self, left_m_s: Array, right_m_s: Array, late: Callable[[Array], Array]) -> Wheels:
        """The same with speeds that follow those of before; ``late`` makes (batch, steps) as late."""
        return replace(self, left_m_s=left_m_s, right_m_s=right_m_s, followed=late(self.moving))


@dataclass(frozen=True)
class Body:
    """Stage ``body``: velocities in the robot's frame.

    An effect returns them changed, with `dataclasses.replace`, `with_added`, `scaled` or `with_drift`. Arrays are (batch, steps).

    forward_m_s, sideways_m_s (positive to the right), m/s, and yaw_rad_s (counter-clockwise), rad/s: mean velocities over the
    step; these are what an effect changes. All else is to look at. moving: from 0 (wheels at rest) to 1. left_m_s, right_m_s:
    what the wheels do, m/s. session_s: time since the session began, s. place: where the robot is in each step, (batch, steps,
    3): x_m, y_m (m), heading_rad (rad); None while nobody knows, where an effect with ``needs_place=True`` returns the body as
    it is. wheelbase_m: distance of the wheels, m. step_s: how long each step lasts, s. conditions: what else was logged
    (`Conditions`); its further columns are in logged, too.
    """

    forward_m_s: Array
    sideways_m_s: Array
    yaw_rad_s: Array
    moving: Array
    left_m_s: Array
    right_m_s: Array
    session_s: Array
    place: Array | None = None
    """Where the robot is in each step, (batch, steps, 3): x_m, y_m, heading_rad; None while nobody knows."""
    wheelbase_m: float = 1.0
    """Of the wheels as they drive, effects on it included."""
    step_s: Array | None = None
    """How long each step lasts, (batch, steps)."""
    conditions: Conditions = NO_CONDITIONS

    @property
    def logged(self) -> Logged:
        """Further columns of the log by name, as `Wheels.logged`."""
        return self.conditions.logged

    def with_added(self, velocity: str, values: Array) -> Body:
        """Something added to the velocity of that name."""
        return replace(self, **{velocity: getattr(self, velocity) + values})

    def scaled(self, factor: Array) -> Body:
        """All velocities times a factor, (batch, steps)."""
        return replace(
            self,
            forward_m_s=self.forward_m_s * factor,
            sideways_m_s=self.sideways_m_s * factor,
            yaw_rad_s=self.yaw_rad_s * factor,
        )

    def with_drift(self, direction: str, values: Array, heading_rad: Array) -> Body:
        """Something added to the velocity ``east`` or ``north`` of a robot that heads so."""
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        forward, right = (cos, sin) if direction == "east" else (sin, -cos)
        added = self.with_added("forward_m_s", values * forward)
        return added.with_added("sideways_m_s", values * right)


@dataclass(frozen=True)
class Flow:
    """Stage ``world``: velocity added while the wheels turn, x_m_s - return_per_s·x; so for y.

    x_m_s, y_m_s: along the axes of the floor, m/s. return_per_s: share of the distance from the origin that the robot is drawn
    back in a second, 1/s. Plain numbers, to which an effect adds its own (`dataclasses.replace`).

    Affine in the position, so that any number of effects add up in any order and the step is solved exactly.
    """

    x_m_s: float = 0.0
    y_m_s: float = 0.0
    return_per_s: float = 0.0


@dataclass(frozen=True)
class Stamps:
    """Stage ``clock``: when the poses were really taken.

    t_s: time since the trial began, s, of any shape; begins as the times that the poses are stamped with. heading_late_s: how
    long before that their headings were, s.
    """

    t_s: Array
    heading_late_s: float = 0.0
    """How long before that their headings were."""


@dataclass(frozen=True)
class View:
    """Stage ``measure``: poses as the tracker reports them.

    poses: (..., 3), that is x_m, y_m (m), heading_rad (rad, counter-clockwise from x).
    """

    poses: Array
